// The largest circle of confusion of every row of stored depth: whether there is anything to blur. See circle.h.

#include "dof_masks/circle.h"

KERNEL void dof_largest(__global const STORED* source, __global float* largest, const grid_params grid,
                          const depth_params depth, const ray_params rays, const circle_params p LENS_ARGUMENTS) {
    const uint y = get_global_id(0);
    if (y >= grid.height)
        return;
    floatV found = 0.0f;
    for (uint x = grid.x_begin; x < grid.x_end; x += V) {
        const uint first = min(x, grid.x_end - V);
        const floatV c = fabs(circles(source, &grid, &depth, &rays, &p LENS_VALUES, first, y));
        found = select(found, c, c > found); // no pixel without a circle
    }
    const float_lanes lanes = found;
    float most = 0.0f;
    for (int i = 0; i < V; ++i)
        most = max(most, ((const float*)&lanes)[i]);
    largest[y] = most;
}
