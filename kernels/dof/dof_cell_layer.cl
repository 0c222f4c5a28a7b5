// Lays layers whose apertures were summed around cells, one after the other. A pixel's sums are interpolated between those of
// the four cells around it, so no light is lost, and none is negative. What is left of T is each pixel's own.
// Built for: CELL = 2 4 8; FILL = 0 1; BEHIND = 0 1 2

#define BRIGHT 0
#define MOMENT 0
#include "dof/layer.h"

// Each cell of a row as often as it has pixels, and where these lie in it: from -1/2 to 1/2.
#if !defined(CELL)
#error "CELL is not defined: 2, 4 or 8, the pixels across and down of a cell"
#elif CELL == 2
#define OF_PIXELS(v) (v).s0011223344556677
#define PLACES (float16)((float4)(-1, 1, -1, 1), (float4)(-1, 1, -1, 1), (float4)(-1, 1, -1, 1), (float4)(-1, 1, -1, 1))
#elif CELL == 4
#define OF_PIXELS(v) (v).s0000111122223333
#define PLACES (float16)((float4)(-3, -1, 1, 3), (float4)(-3, -1, 1, 3), (float4)(-3, -1, 1, 3), (float4)(-3, -1, 1, 3))
#else
#define OF_PIXELS(v) (v).s0000000011111111
#define PLACES (float16)((float8)(-7, -5, -3, -1, 1, 3, 5, 7), (float8)(-7, -5, -3, -1, 1, 3, 5, 7))
#endif

// The sums of cells, between two rows.
INLINE float16 between_rows(__global const float* here, long next, float part) {
    const float16 value = LOAD_16(here);
    return fma((float16)part, LOAD_16(here + next) - value, value);
}

// One sum around 16 pixels of a row.
INLINE float16 at_pixels(__global const float* here, long next, float part) {
    const float16 places = PLACES * (0.5f / CELL);
    const float16 value = OF_PIXELS(between_rows(here, next, part));
    const float16 left = OF_PIXELS(between_rows(here - 1, next, part)) - value;
    const float16 right = OF_PIXELS(between_rows(here + 1, next, part)) - value;
    return fma(max(-places, 0.0f), left, fma(max(places, 0.0f), right, value));
}

KERNEL void dof_cell_layer(__global const float* planes, __global const float* sums, __global const uint* list,
                             __global float* state, const blur_params p, const cell_params s) {
    const uint item = get_global_id(0), x = item % (dof_tile_columns / 16) * 16;
    const uint index = item / (dof_tile_columns / 16) / dof_tile_rows;
    if (index >= s.tiles)
        return;
    const uint entry = list[s.tile_list + 3 * index], across = ENTRY_ACROSS(entry);
    const uint reach = list[s.tile_list + 3 * index + 1], follow = list[s.tile_list + 3 * index + 2];
    const int y = (int)(ENTRY_DOWN(entry) * dof_tile_rows + item / (dof_tile_columns / 16) % dof_tile_rows);
    const size_t at = in_planes(&p, across, x, y);
    __global float* of_pixels = state + in_state(&p, at);
    const long stride = (long)s.across * dof_block_columns;
    const int column = (int)(across * dof_tile_columns + x) / CELL - s.column * dof_block_columns;
    const int row = y / CELL - s.row * dof_block_rows;
    __global const float* here = sums + row * stride + column;
    const int place = 2 * (y % CELL) + 1 - CELL; // of CELL
    const long next = place < 0 ? -stride : stride;
    const float part = fabs((float)place) * (0.5f / CELL);
    for (uint nth = 0; nth < 32 && reach >> nth; ++nth, here += s.one) {
        if (!(reach >> nth & 1u))
            continue;
        if (!any(LOAD_16(of_pixels) > 0.0f))
            return;
        float16 sum[PLANES];
        sum[0] = at_pixels(here, next, part);
        if (!any(sum[0] > 0.0f)) {
            for (uint i = 0; i < 16; i += V)
                keep_open(of_pixels + i, &p, 1);
            continue;
        }
        for (int k = 1; k < PLANES; ++k)
            sum[k] = at_pixels(here + (size_t)k * s.plane, next, part);
        const layer_at layer = {planes, &p, s.layer + (float)nth, follow >> nth & 1u, entry & ENTRY_FOREGROUND};
        for (uint i = 0; i < 16; i += V) {
            floatV of_lanes[PLANES];
            for (int k = 0; k < PLANES; ++k)
                of_lanes[k] = *(const float_lanes*)((const float*)&sum[k] + i);
            lay(&layer, state, at + i, of_lanes);
        }
    }
}
