// Positions from depth that was stored through a lens, V pixels per work-item.
//   position = centre + distance u(x, y),   u the unit ray of the pixel                                   see patch.h
// View and world space differ in constants only. docs/camera.md, "Lenses".
// Built for: FORM = 0 1 2 3 4; PIXEL_TERMS = 0; W_IS_DEPTH = 1

#include "camera/patch.h"
#include "store.h"

INLINE floatV patch_position(const float* centre, floatV distance, pairV ray) {
    return fma(distance, ray.high, fma(distance, ray.low, (floatV)centre[1]) + centre[0]);
}

KERNEL void lens_unproject(__global const STORED* source, __global float* target, __global const uint* tiles,
                           __global const float* nodes, const grid_params grid, const depth_params depth,
                           const lens_params lens) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    const floatV stored = view_depth(load_stored(source, &grid, x, y, &depth), px, py, &depth, 0);
    const patch_rayV ray = patch_rays(tiles, nodes, &lens, px, py);
    const floatV along = patch_distance(stored, &ray, &lens);
    const floatV distance = select(along, (floatV)NAN, isinf(along)); // the background lies at no place
    const floatV position_z = patch_position(lens.centre[2], distance, ray.z);
    store_vectors(patch_position(lens.centre[0], distance, ray.x), patch_position(lens.centre[1], distance, ray.y),
                  position_z, select((floatV)1.0f, (floatV)0.0f, isnan(position_z)),
                  target + grid.target_offset + (size_t)y * grid.target_stride + (size_t)CHANNELS * x);
}
