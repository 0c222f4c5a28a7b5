// Sums over the aperture around every cell of layers. A block's rows share what they read.
// Built for: FILL = 0 1

#define BRIGHT 0
#define MOMENT 0
#define BEHIND 0
#include "dof/layer.h"

#define ROWS (4 / (1 + FILL)) // at once: as many sums as there are registers

// What a row of blocks holds of the layer, from before `low` to beyond `high` columns around a block.
INLINE float found_beside(__global const float* found, int low, int high) {
    float most = 0.0f;
    const int last = (high + dof_block_columns - 1) / dof_block_columns;
    for (int i = (low - dof_block_columns + 1) / dof_block_columns; i <= last; ++i)
        most = max(most, found[i]);
    return most;
}

KERNEL void dof_cell_sums(__global const float* cells, __global const uint* list,
                            __global const uint* starts, __global const float* weights, __global float* sums,
                            const cell_params s) {
    const uint item = get_global_id(0), index = item / (dof_block_rows / ROWS);
    if (index >= s.sum_blocks)
        return;
    const uint entry = list[s.sum_list + 2 * index], nth = list[s.sum_list + 2 * index + 1];
    const uint first = starts[s.layers + 2 * nth];
    const int reach = (int)starts[s.layers + 2 * nth + 1];
    cells += (size_t)nth * s.one;
    sums += (size_t)nth * s.one;
    const int column = (int)ENTRY_ACROSS(entry), stride = s.across * dof_block_columns;
    const int row = (int)ENTRY_DOWN(entry) * dof_block_rows + (int)(item % (dof_block_rows / ROWS)) * ROWS;
    const size_t at = (size_t)row * stride + column * dof_block_columns;
    __global const float* found = cells + PLANES * s.plane;
    float16 sum[ROWS][PLANES];
    for (int i = 0; i < ROWS; ++i)
        for (int k = 0; k < PLANES; ++k)
            sum[i][k] = 0.0f;
    for (int other = row - reach; other < row + ROWS + reach; ++other) {
        // Of a row: how many columns of the aperture, and where the weights of these for each of ROWS rows begin.
        __global const uint* start = starts + first + 2 * (other - row + reach);
        const int aside = (int)start[0];
        const float holds = found_beside(found + other / dof_block_rows * s.across + column, -aside, aside);
        if (holds == 0.0f)
            continue;
        __global const float* from = cells + (size_t)other * stride + column * dof_block_columns - aside;
        __global const float* weight = weights + start[1];
        if (FILL | (holds == 2.0f)) {
            for (int x = 0; x <= 2 * aside; ++x, ++from, weight += ROWS) {
#pragma unroll
                for (int k = 0; k < PLANES; ++k) {
                    const float16 value = LOAD_16(from + k * s.plane);
#pragma unroll
                    for (int i = 0; i < ROWS; ++i)
                        sum[i][k] = fma((float16)weight[i], value, sum[i][k]);
                }
            }
        } else {
            for (int x = 0; x <= 2 * aside; ++x, ++from, weight += ROWS) {
                const float16 value = LOAD_16(from + s.plane);
#pragma unroll
                for (int i = 0; i < ROWS; ++i)
                    sum[i][1] = fma((float16)weight[i], value, sum[i][1]);
            }
        }
    }
    for (int i = 0; i < ROWS; ++i)
        for (int k = 0; k < PLANES; ++k)
            *(__global float16_anywhere*)(sums + at + (size_t)i * stride + k * s.plane) = sum[i][k];
}
