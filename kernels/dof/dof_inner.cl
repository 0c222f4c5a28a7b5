// The layers of the pixels that no neighbour lies before: what antialiasing mixes with nothing nearer. And the farthest layer in
// every block, of these pixels and of all, and its circle.

#include "dof/tiles.h"

KERNEL void dof_inner(__global const float* planes, __global float* inner, __global float* blocks, const blur_params p,
                        const behind_params b) {
    const uint column = get_global_id(0), row = get_global_id(1);
    if (column >= b.block_columns)
        return;
    float farthest = NOWHERE, farthest_inner = NOWHERE;
    for (uint y = dof_behind_block * row; y < dof_behind_block * (row + 1); ++y) {
        for (uint x = dof_behind_block * column; x < dof_behind_block * (column + 1); ++x) {
            const size_t at = in_planes(&p, 0, x, y);
            const float here = planes[at];
            float nearest = here;
            for (int j = y > 0 ? -1 : 0; j <= (y + 1 < p.rows ? 1 : 0); ++j) {
                for (int i = -1; i <= 1; ++i) {
                    const float other = planes[(long)at + j * (long)p.stride + i];
                    nearest = other >= 0.0f ? min(nearest, other) : nearest;
                }
            }
            const float layer = here > nearest + JUMP && excess_of(here, &p) > excess_of(nearest, &p) + APART ? NOWHERE : here;
            inner[at] = layer;
            farthest = max(farthest, here);
            farthest_inner = max(farthest_inner, layer);
        }
    }
    __global float* block = blocks + row * b.block_columns + column;
    const uint count = b.block_columns * b.block_rows;
    block[0] = farthest_inner;
    block[count] = circle_of(farthest_inner, &p);
    block[2 * count] = farthest;
    block[3 * count] = circle_of(farthest, &p);
}
