// The least and the greatest circle of confusion in each tile of an image, or of each block in an image of tiles. NaN
// is left out; a tile of nothing but NaN has NaN.

#include "vector.h"

KERNEL void near_field_tiles(__global const float* least, __global const float* greatest, __global float* tile_min_coc,
                         __global float* tile_max_coc, const near_field_params p) {
    const uint column = get_global_id(0), row = get_global_id(1);
    if (column >= p.columns || row >= p.rows)
        return;

    const uint right = min((column + 1) * p.tile, p.width), bottom = min((row + 1) * p.tile, p.height);
    float low = INFINITY, high = -INFINITY;
    for (uint y = row * p.tile; y < bottom; ++y) {
        for (uint x = column * p.tile; x < right; ++x) {
            const size_t at = (size_t)y * p.stride + x;
            low = least[at] < low ? least[at] : low;
            high = greatest[at] > high ? greatest[at] : high;
        }
    }
    const size_t there = (size_t)row * p.tile_stride + column;
    const int none = low > high; // not where all are infinite
    tile_min_coc[there] = none ? NAN : low;
    tile_max_coc[there] = none ? NAN : high;
}
