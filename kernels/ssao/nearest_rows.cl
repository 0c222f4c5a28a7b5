// Inverse depth of the nearest surface of every row, how far a radius reaches on the screen there: -FLT_MAX where a row has
// none.

#include "vector.h"

__kernel void nearest_rows(__global const float* depth, __global float* nearest, const grid_params grid) {
    const uint y = get_global_id(0);
    if (y >= grid.height)
        return;
    __global const float* const row = depth + grid.source_offset + (size_t)y * grid.source_stride;
    floatV found = -FLT_MAX;
    for (uint x = 0; x < grid.x_end; x += V) { // the margin behind the row is invalid
        const floatV q = LOAD(float, row + x);
        found = select(found, q, q > found);
    }
    nearest[grid.y_begin + y] = -least_of(-found);
}
