// View depth from stored depth, V pixels per work-item.
//   z = -(m3.q) / (m4.q),  q = (x, y, d, 1)                                        see camera.h
// Popov 2016, eq. 1, 3 and 5-9. Sums are made so that no term cancels more than it must: engines' 1 / (Z d + W) loses 8%
// at far/near = 10^6 where this keeps half an ulp, and both wait for the same memory.
// Through a lens a depth along the ray is one along the axis times that axis's part of the ray, see through_lens.h.
// Built for: AS_DISTANCE = 0 1

#include "camera/distance.h"
#include "camera/through_lens.h"

KERNEL void linearize(__global const STORED* source, __global float* target, const grid_params grid,
                        const depth_params depth, const ray_params rays LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

#if LENS
    const lens_pixelV pixel = lens_pixels(source, tiles, nodes, &grid, &depth, &lens, x, y);
#if AS_DISTANCE
    const floatV z = pixel.distance;
#else
    const floatV z = along_axis(&pixel, &lens);
#endif
#else
    const sampleV sample = load_stored(source, &grid, x, y, &depth);
    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    floatV z = view_depth(sample, px, py, &depth, &rays);
#if AS_DISTANCE
    z = ray_distance(sample.value, z, px, py, &depth, &rays);
#endif
#endif
    store_float(z, target + grid.target_offset + (size_t)y * grid.target_stride + x);
}
