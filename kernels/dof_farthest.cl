// The farthest layer in every block of pixels.

#include "tiles.h"

__kernel void dof_farthest(__global const float* planes, __global float* blocks, const blur_params p, const behind_params b) {
    const uint column = get_global_id(0), row = get_global_id(1);
    if (column >= b.block_columns)
        return;
    float farthest = NOWHERE;
    const uint side = dof_behind_block;
    for (uint y = 0; y < side; ++y)
        for (uint x = 0; x < side; ++x)
            farthest = max(farthest, planes[in_planes(&p, 0, side * column + x, side * row + y)]);
    blocks[row * b.block_columns + column] = farthest;
}
