// Where a depth lies between two contour lines, V pixels per work-item: t - floor(t) with t = z / step.

#include "camera/camera.h"

KERNEL void contours(__global const STORED* source, __global float* target, const grid_params grid,
                     const depth_params depth, const ray_params rays, const contours_params p) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;
    const sampleV sample = load_stored(source, &grid, x, y, &depth);
    const floatV t = view_depth(sample, grid.pixel_x + x, grid.pixel_y + y, &depth, &rays) * p.per_step;
    store_float(t - floor(t), target + grid.target_offset + (size_t)y * grid.target_stride + x);
}
