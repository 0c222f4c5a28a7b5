// Inverse depth from stored depth: what planes are affine in on the screen, greater the nearer a surface is.
//   q = depth(x, y) / (z - centre_depth)   under a perspective,      q = -z   for an orthographic camera
//   q = 1 / distance                       through a lens, where planes are affine in the pixel's unit ray
// 1/z of the plain perspective. Background becomes 0 or -infinity, an invalid pixel NaN, and so does the margin around the
// image: depth_margin_rows above it, one more below it, and the columns between its rows. docs/camera.md.
// Built for: PERSPECTIVE = 0 1

#include "camera/through_lens.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in the camera centre, 0 where they are parallel (orthographic)"
#endif

KERNEL void inverse_depth(__global const STORED* source, __global float* target, const grid_params grid,
                     const depth_params depth, const ray_params rays LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint row = get_global_id(1), y = row - depth_margin_rows;
    if (x >= grid.x_end || row > grid.height + 2 * depth_margin_rows)
        return;
    __global float* const start =
        target + (grid.target_offset + (size_t)row * grid.target_stride - depth_margin_rows * (size_t)grid.target_stride);
    if (x == grid.x_begin) {
        for (uint i = 1; i <= depth_margin_columns; ++i)
            start[-(int)i] = NAN;
        for (uint i = grid.x_end; i + depth_margin_columns < grid.target_stride; ++i)
            start[i] = NAN;
    }
    if (y >= grid.height) {
        store_float((floatV)NAN, start + x);
        return;
    }

#if LENS
    const floatV q = inverse_through_lens(source, tiles, nodes, &grid, &depth, &lens, x, y);
#else
    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    const floatV z = view_depth(load_stored(source, &grid, x, y, &depth), px, py, &depth, &rays);
#if PERSPECTIVE
    const wideV beyond_centre = wide_add(wide_from(z), wide_negative(wide_constant(rays.centre_depth)));
    const floatV distance = select(wide_to_float(beyond_centre), z, isinf(z)); // sums of two floats make NaN of infinity
#if W_IS_DEPTH
    const floatV q = 1.0f / distance;
#else
    const floatV q = wide_to_float(wide_at_pixel(rays.depth, px, py)) / distance;
#endif
#else
    const floatV q = -z;
#endif
#endif
    store_float(q, start + x);
}
