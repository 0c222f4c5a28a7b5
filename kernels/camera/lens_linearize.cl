// Distances from depth that was stored through a lens, V pixels per work-item: along the view axis or along the ray.
//   z = distance (u . axis),   u the unit ray of the pixel                                                see patch.h
// Built for: FORM = 0 1 2 3 4; PIXEL_TERMS = 0; W_IS_DEPTH = 1; AS_DISTANCE = 0 1

#include "camera/patch.h"

KERNEL void lens_linearize(__global const STORED* source, __global float* target, __global const uint* tiles,
                           __global const float* nodes, const grid_params grid, const depth_params depth,
                           const lens_params lens) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    const floatV stored = view_depth(load_stored(source, &grid, x, y, &depth), px, py, &depth, 0);
    const patch_rayV ray = patch_rays(tiles, nodes, &lens, px, py);
    floatV result = patch_distance(stored, &ray, &lens);
#if !AS_DISTANCE && ALONG_AXIS
    result = select(stored, (floatV)NAN, isnan(result));
#elif !AS_DISTANCE
    const floatV ahead = fma(result, ray.ahead.high, result * ray.ahead.low);
    result = select(ahead, result, isinf(result)); // infinitely far on either side of the camera
#endif
    store_float(result, target + grid.target_offset + (size_t)y * grid.target_stride + x);
}
