// Running sums of 16 pixels, and the rows of strips that they fill.

#ifndef FATHOM_RUNNING_H
#define FATHOM_RUNNING_H

#include "dof/tiles.h"

// Sums over the lanes before each one, and over all of them, always in the same order.
#if CLANG_BUILTINS
#define LATER(v, ...) __builtin_shufflevector(v, (float16)0.0f, __VA_ARGS__)
#define LATER_1(v) LATER(v, 16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14)
#define LATER_2(v) LATER(v, 16, 16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13)
#define LATER_4(v) LATER(v, 16, 16, 16, 16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)
#define LATER_8(v) LATER(v, 16, 16, 16, 16, 16, 16, 16, 16, 0, 1, 2, 3, 4, 5, 6, 7)
#else
#define LATER_1(v) (float16)(0.0f, v.s0123, v.s4567, v.s89ab, v.sc, v.sd, v.se)
#define LATER_2(v) (float16)((float2)0.0f, v.s01234567, v.s89ab, v.scd)
#define LATER_4(v) (float16)((float4)0.0f, v.s01234567, v.s89ab)
#define LATER_8(v) (float16)((float8)0.0f, v.s01234567)
#endif

// The running sums up to each pixel of `value`, continued from `sum`.
INLINE float16 running(float16 value, float* sum) {
    float16 before = LATER_1(value);
    before += LATER_1(before);
    before += LATER_2(before);
    before += LATER_4(before);
    before += LATER_8(before);
    const float16 sums = *sum + before;
    *sum += before.sf + value.sf;
    return sums;
}

// The row of a tile's strip that a work-item fills: from pixels [first, end) of the rows at `source`.
typedef struct {
    uint across, down;
    int first, end;
    __global const float* source;
    __global float* target;
} strip_row;

INLINE strip_row strip_row_of(__global const float* planes, __global const uint* list, __global float* strips,
                              const blur_params* p, const layer_params* s, uint index, uint row) {
    const uint across = ENTRY_ACROSS(list[s->list + index]), down = ENTRY_DOWN(list[s->list + index]);
    const uint kept = (down - s->first) * (dof_tile_rows / s->pitch) + row;
    return (strip_row){across, down, (int)(across * dof_tile_columns) - (int)s->pad,
                       (int)(across * dof_tile_columns + dof_tile_columns + s->pad),
                       planes + in_planes(p, 0, 0, down * dof_tile_rows + row * s->pitch),
                       strips + (size_t)(across - s->first_column) * s->strip_column + (size_t)kept * s->strip_row};
}

#endif
