// The least circle of confusion in each tile of an image, or of each block in an image of tiles; and the greatest one, if it is
// wanted. NaN is left out; a tile of nothing but NaN has NaN.
// Built for: GREATEST = 0 1

#include "vector.h"

#ifndef GREATEST
#error "GREATEST is not defined: 1 to write the greatest circles as well as the least, 0 for the least alone"
#endif

KERNEL void near_field_tiles(__global const float* source, const place_params source_place, __global float* tile_min_coc,
                         const place_params min_place,
#if GREATEST
                         __global float* tile_max_coc, const place_params max_place,
#endif
                         const near_field_params p) {
    const uint column = get_global_id(0), row = get_global_id(1);
    if (column >= p.columns || row >= p.rows)
        return;

    const uint left = max(column * p.tile, p.left) - p.left, right = min((column + 1) * p.tile, p.left + p.width),
               top = max(row * p.tile, p.top) - p.top, bottom = min((row + 1) * p.tile, p.top + p.height);
    float low = INFINITY, high = -INFINITY;
    for (uint y = top; y + p.top < bottom; ++y) {
        __global const float* values = source + element_at(&source_place, 0, y);
        for (uint x = left; x + p.left < right; ++x) {
            low = values[x] < low ? values[x] : low;
            high = values[x] > high ? values[x] : high;
        }
    }
    const int none = low > high; // not where all are infinite
    tile_min_coc[element_at(&min_place, column, row)] = none ? NAN : low;
#if GREATEST
    tile_max_coc[element_at(&max_place, column, row)] = none ? NAN : high;
#endif
}
