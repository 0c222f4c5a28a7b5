// The farthest layer in every block of 8 x 8 pixels.

#include "tiles.h"

__kernel void dof_farthest(__global const float* planes, __global float* blocks, const blur_params p, const behind_params b) {
    const uint column = get_global_id(0), row = get_global_id(1);
    if (column >= b.block_columns)
        return;
    float farthest = NOWHERE;
    for (uint y = 0; y < 8; ++y)
        for (uint x = 0; x < 8; ++x)
            farthest = max(farthest, planes[in_planes(&p, 0, 8 * column + x, 8 * row + y)]);
    blocks[row * b.block_columns + column] = farthest;
}
