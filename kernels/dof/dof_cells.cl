// Cells of layers: for each layer the sums of what its pixels count. A cell is a square of 2, 4 or 8 pixels. Where the aperture
// is many cells wide, it is summed over them instead of pixels.
// After the planes of sums stands for every block what it holds: 2: pixels of the layer; 1: only pixels behind it; 0: none.
// Built for: CELL = 2 4 8; FILL = 0 1; BEHIND = 0 1 2

#define BRIGHT 0
#define MOMENT 0
#include "dof/layer.h"

#ifndef CELL
#error "CELL is not defined: 2, 4 or 8, the pixels across and down of a cell"
#endif

// Sums of neighbouring pairs, of `a` and then of `b`.
INLINE float16 pairs(float16 a, float16 b) {
    return (float16)(a.even + a.odd, b.even + b.odd);
}

// What the tiles of a block hold of layer k.
INLINE uint found_in_block(__global const uint* tiles, const blur_params* p, int x, int y, uint k) {
    uint found = 0;
    const int right = min(x + CELL * dof_block_columns, (int)p->columns);
    const int bottom = min(y + CELL * dof_block_rows, (int)p->rows);
    for (int row = max(y, 0) / dof_tile_rows; row * dof_tile_rows < bottom; ++row)
        for (int column = max(x, 0) / dof_tile_columns; column * dof_tile_columns < right; ++column)
            found = max(found, found_around(tiles, p, (uint)column, (uint)row, 0, k));
    return found;
}

KERNEL void dof_cells(__global const float* planes, __global const uint* tiles, __global const uint* list,
                        __global float* cells, const blur_params p, const cell_params s) {
    const uint index = get_global_id(0);
    if (index >= s.blocks)
        return;
    const uint entry = list[s.list + 2 * index], nth = list[s.list + 2 * index + 1];
    const float layer = s.layer + (float)nth;
    cells += (size_t)nth * s.one;
    const int column = (int)ENTRY_ACROSS(entry), row = (int)ENTRY_DOWN(entry);
    const int x = (column + s.column) * CELL * dof_block_columns, y = (row + s.row) * CELL * dof_block_rows;
    const uint holds = found_in_block(tiles, &p, x, y, (uint)layer);
    cells[PLANES * s.plane + row * s.across + column] = (float)holds;
    const int stride = s.across * dof_block_columns;
    __global float* target = cells + (size_t)(row * dof_block_rows) * stride + column * dof_block_columns;
    for (int i = 0; i < dof_block_rows; ++i, target += stride) {
        float16 value[CELL][PLANES];
        for (int j = 0; j < CELL; ++j)
            for (int k = 0; k < PLANES; ++k)
                value[j][k] = 0.0f;
        for (int down = y + i * CELL; holds > 0 && down < y + (i + 1) * CELL; ++down) {
            if (down < 0 || down >= (int)p.rows)
                continue;
            for (int j = 0; j < CELL; ++j) {
                const int across = x + dof_block_columns * j;
                if (across < 0 || across >= (int)p.columns)
                    continue;
                __global const float* here = planes + in_planes(&p, 0, (uint)across, (uint)down);
                if (FILL | (holds == 2))
                    add_pixels(value[j], here, layer, 0.0f, &p);
                else
                    value[j][1] += behind_either(here, layer, &p);
            }
        }
        for (int count = CELL / 2; count > 0; count /= 2)
            for (int j = 0; j < count; ++j)
                for (int k = 0; k < PLANES; ++k)
                    value[j][k] = pairs(value[2 * j][k], value[2 * j + 1][k]);
        for (int k = 0; k < PLANES; ++k)
            *(__global float16_anywhere*)(target + k * s.plane) = value[0][k];
    }
}
