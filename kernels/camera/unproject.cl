// Positions from stored depth, V pixels per work-item.
//   position = origin(x, y) + w direction(x, y)
// w is the view depth, or its quotient by the depth that one step of the direction covers where the projection's fourth
// row has x and y. Through a lens it is the distance, along the pixel's unit ray. View and world space, perspective and
// orthographic differ in constants only.
// Lenaerts, reconstructing positions from the depth buffer, part 2; docs/camera.md.

#include "camera/through_lens.h"
#include "store.h"

#if LENS
INLINE floatV along_bent_ray(const float* centre, floatV distance, pairV ray) {
    return fma(distance, ray.high, fma(distance, ray.low, (floatV)centre[1]) + centre[0]);
}
#else
INLINE floatV along_ray(const wide* origin, const wide* direction, floatV w, uint x, uint y) {
    return wide_to_float(wide_multiply_add(wide_at_pixel(direction, x, y), w, wide_at_pixel(origin, x, y)));
}
#endif

KERNEL void unproject(__global const STORED* source, __global float* target, const grid_params grid,
                        const depth_params depth, const ray_params view_rays,
                        const ray_params rays LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

#if LENS
    const lens_pixelV pixel = lens_pixels(source, tiles, nodes, &grid, &depth, &lens, x, y);
    const floatV along = pixel.distance;
#else
    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    const sampleV sample = load_stored(source, &grid, x, y, &depth);
    const floatV z = view_depth(sample, px, py, &depth, &view_rays);
#if W_IS_DEPTH
    const floatV along = z;
#else
    const wideV beyond_centre = wide_add(wide_from(z), wide_negative(wide_constant(rays.centre_depth)));
    const floatV along = wide_quotient(beyond_centre, wide_at_pixel(rays.depth, px, py));
#endif
#endif
    const floatV w = select(along, (floatV)NAN, isinf(along)); // the background lies at no place
#if LENS
    const floatV position_x = along_bent_ray(lens.centre[0], w, pixel.ray.x),
                 position_y = along_bent_ray(lens.centre[1], w, pixel.ray.y),
                 position_z = along_bent_ray(lens.centre[2], w, pixel.ray.z);
#else
    const floatV position_x = along_ray(rays.origin[0], rays.direction[0], w, px, py),
                 position_y = along_ray(rays.origin[1], rays.direction[1], w, px, py),
                 position_z = along_ray(rays.origin[2], rays.direction[2], w, px, py);
#endif
    store_vectors(position_x, position_y, position_z, select((floatV)1.0f, (floatV)0.0f, isnan(position_z)),
                  target + grid.target_offset + (size_t)y * grid.target_stride + (size_t)CHANNELS * x);
}
