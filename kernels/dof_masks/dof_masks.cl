// Circle of confusion and what is near, in focus and far, from stored depth in one pass.
//   a = clamp((|c| - sharp) / transition, 0, 1),  near = a where c < 0,  far = a where c > 0,  focus = 1 - a
// a is rounded to a multiple of 2^-23, so that the three sum to exactly 1 in any order. See circle.h for c.
// Built for: WEIGHTS = 0 1

#include "dof_masks/circle.h"
#include "dof_masks/near_field.h"

#ifndef WEIGHTS
#error "WEIGHTS is not defined: 1 to write the three weights as well as the circle, 0 for the circle alone"
#endif

KERNEL void dof_masks(__global const STORED* source, __global float* circle,
#if WEIGHTS
                        __global float* near, const place_params near_place, __global float* focus,
                        const place_params focus_place, __global float* far, const place_params far_place,
#endif
                        const grid_params grid, const depth_params depth, const ray_params rays,
                        const circle_params p LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

    const floatV c = circles(source, &grid, &depth, &rays, &p LENS_VALUES, x, y);
    store_float(c, circle + grid.target_offset + (size_t)y * grid.target_stride + x);
#if WEIGHTS
    const floatV one_more = one_and_blurred(c, p.sharp, p.inverse_transition), none = (floatV)0.0f;
    const floatV away = one_more - 1.0f;
    store_float(select(none, away, c < 0.0f), near + element_at(&near_place, x, y));
    store_float(select(none, 2.0f - one_more, c == c), focus + element_at(&focus_place, x, y));
    store_float(select(none, away, c > 0.0f), far + element_at(&far_place, x, y));
#endif
}
