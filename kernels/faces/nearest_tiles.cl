// Inverse distance of the nearest surface of each tile of 16 x 16 pixels of the camera's image, which says how far a radius reaches
// on a face: -FLT_MAX where a tile has none.

#include "vector.h"

__kernel void nearest_tiles(__global const float* depth, __global float* nearest, const grid_params grid) {
    const uint column = get_global_id(0), row = get_global_id(1), last = 15;
    if (column >= grid.x_end)
        return;
    // The margin around the image is invalid, and as wide as a tile.
    const int left = (int)(16 * column) - (int)(grid.pixel_x & last), top = (int)(16 * row) - (int)(grid.pixel_y & last);
    floatV found = -FLT_MAX;
    for (int y = max(top, 0); y < min(top + 16, (int)grid.height); ++y)
        for (int x = left; x < left + 16; x += V) {
            const floatV q = LOAD(float, depth + (long)grid.source_offset + (long)y * grid.source_stride + x);
            found = select(found, q, q > found);
        }
    nearest[row * grid.target_stride + column] = -least_of(-found);
}
