// Positions from stored depth, V pixels per work-item.
//   position = origin(x, y) + w direction(x, y)
// w is the view depth, or its quotient by the depth that one step of the direction covers where the projection's fourth
// row has x and y. View and world space, perspective and orthographic differ in constants only.
// Lenaerts, reconstructing positions from the depth buffer, part 2; docs/camera.md.

#include "camera/camera.h"
#include "store.h"

INLINE floatV along_ray(const wide* origin, const wide* direction, floatV w, uint x, uint y) {
    return wide_to_float(wide_multiply_add(wide_at_pixel(direction, x, y), w, wide_at_pixel(origin, x, y)));
}

KERNEL void unproject(__global const STORED* source, __global float* target, const grid_params grid,
                        const depth_params depth, const ray_params view_rays, const ray_params rays) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    const sampleV sample = load_stored(source, &grid, x, y, &depth);
    const floatV z = view_depth(sample, px, py, &depth, &view_rays);
#if W_IS_DEPTH
    const floatV along = z;
#else
    const wideV beyond_centre = wide_add(wide_from(z), wide_negative(wide_constant(rays.centre_depth)));
    const floatV along = wide_quotient(beyond_centre, wide_at_pixel(rays.depth, px, py));
#endif
    const floatV w = select(along, (floatV)NAN, isinf(along)); // the background lies at no place
    const floatV position_z = along_ray(rays.origin[2], rays.direction[2], w, px, py);
    store_vectors(along_ray(rays.origin[0], rays.direction[0], w, px, py),
                  along_ray(rays.origin[1], rays.direction[1], w, px, py), position_z,
                  select((floatV)1.0f, (floatV)0.0f, isnan(position_z)),
                  target + grid.target_offset + (size_t)y * grid.target_stride + (size_t)CHANNELS * x);
}
