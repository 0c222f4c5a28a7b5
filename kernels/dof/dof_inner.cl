// The layers of the pixels that no neighbour lies before: what antialiasing mixes with nothing nearer. And the farthest layer in
// every block, of these pixels and of all, and its circle.

#include "dof/tiles.h"

INLINE float greatest_of_8(float8 v) {
    const float4 four = max(v.lo, v.hi);
    return max(max(four.x, four.y), max(four.z, four.w));
}

KERNEL void dof_inner(__global const float* planes, __global float* inner, __global float* blocks, const blur_params p,
                        const behind_params b) {
    const uint column = get_global_id(0), row = get_global_id(1);
    if (column >= b.block_columns)
        return;
    float8 all = NOWHERE, all_inner = NOWHERE;
    for (uint y = dof_behind_block * row; y < dof_behind_block * (row + 1); ++y) {
        const size_t at = in_planes(&p, 0, dof_behind_block * column, y);
        const float8 here = *(__global const float8_anywhere*)(planes + at);
        float8 nearest = here;
        for (int j = y > 0 ? -1 : 0; j <= (y + 1 < p.rows ? 1 : 0); ++j) {
            for (int i = -1; i <= 1; ++i) {
                const float8 other = *(__global const float8_anywhere*)(planes + ((long)at + j * (long)p.stride + i));
                nearest = select(nearest, min(nearest, other), other >= 0.0f);
            }
        }
        float8 layer = here;
        if (any_of_8(here > nearest + JUMP)) {
            const int8 apart = excess_of_8(here, &p) > excess_of_8(nearest, &p) + APART;
            layer = select(here, (float8)(NOWHERE), (here > nearest + JUMP) & apart);
        }
        *(__global float8_anywhere*)(inner + at) = layer;
        all = max(all, here);
        all_inner = max(all_inner, layer);
    }
    const float farthest = greatest_of_8(all), farthest_inner = greatest_of_8(all_inner);
    __global float* block = blocks + row * b.block_columns + column;
    const uint count = b.block_columns * b.block_rows;
    block[0] = farthest_inner;
    block[count] = circle_of(farthest_inner, &p);
    block[2 * count] = farthest;
    block[3 * count] = circle_of(farthest, &p);
}
