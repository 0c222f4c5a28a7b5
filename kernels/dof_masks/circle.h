// The signed circle of confusion of a stored value at a pixel, without a depth in between where there is another way.
//   c = k - g/(z - lens)        under a perspective in the window encoding, where 1/(z - lens) is affine in (v, x, y)
//   c = g z - k                 under an orthographic projection
// Potmesil and Chakravarty 1981; that 1/z is affine is Popov 2016, eq. 5 and 6. Host side: src/operations/dof_masks/circle.cpp.
//   c = k - g/distance                  through a lens with a sphere in focus, and k - g/z with a plane
// Built for: PLANE_IN_FOCUS = 0 1; CIRCLE = 0 1 2 3; TELECENTRIC = 0 1

#ifndef FATHOM_CIRCLE_H
#define FATHOM_CIRCLE_H

#include "camera/through_lens.h"

#if !defined(CIRCLE) || CIRCLE < CIRCLE_RECENTRED || CIRCLE > CIRCLE_OF_DEPTH
#error "CIRCLE is not defined: one of the CIRCLE_ constants of params.h"
#endif
#ifndef TELECENTRIC
#error "TELECENTRIC is not defined: 1 for an orthographic camera, 0 under a perspective"
#endif

// k - g s
INLINE floatV circle_of_inverse(wideV s, const circle_params* p) {
    return wide_to_float(wide_add(wide_constant(p->k), wide_negative(wide_product(wide_constant(p->g), s))));
}

INLINE floatV no_larger(floatV c, const circle_params* p) {
    return select((floatV)-p->largest, min(c, (floatV)p->largest), c > -p->largest); // NaN where a float overflowed
}

#if LENS
#ifndef PLANE_IN_FOCUS
#error "PLANE_IN_FOCUS is not defined: 1 where circles follow the depth along the axis, 0 where they follow the distance"
#endif

// Circles of the V pixels from (x, y) of the image on: the background has the one that the host gives, an invalid pixel has NaN.
INLINE floatV circles(__global const STORED* source, const grid_params* grid, const depth_params* depth,
                      const ray_params* rays, const circle_params* p, __global const uint* tiles,
                      __global const float* nodes, const lens_params* lens, uint x, uint y) {
    const lens_pixelV pixel = lens_pixels(source, tiles, nodes, grid, depth, lens, x, y);
#if PLANE_IN_FOCUS
    const floatV z = along_axis(&pixel, lens);
#else
    const floatV z = pixel.distance;
#endif
    const floatV c = circle_of_inverse(wide_ratio(wide_from((floatV)1.0f), wide_from(z)), p);
    const floatV surface = select(no_larger(c, p), (floatV)p->infinite, z == INFINITY);
    return select(select((floatV)NAN, surface, z > 0.0f), (floatV)p->sky, pixel.background & (z > 0.0f));
}
#else
// The circle of a stored value. Clears `surface` where the value does not lie in front of the lens.
#if CIRCLE == CIRCLE_RECENTRED
// At the far end 1/z is smallest, so at_end is no larger than k unless the focus lies beyond it. Neither term exceeds
// |c| + k, so the error is at most four roundings of that. t is exact in the far half of the range.
INLINE floatV circle_law(floatV v, uint x, uint y, const depth_params* depth, const ray_params* rays,
                         const circle_params* p, intV* surface) {
    const floatV t = fma((floatV)p->sign, v, (floatV)p->end);
    return fma((floatV)p->slope_high, t, fma((floatV)p->slope_low, t, (floatV)p->at_end));
}
#elif CIRCLE == CIRCLE_SUM
INLINE floatV circle_law(floatV v, uint x, uint y, const depth_params* depth, const ray_params* rays,
                         const circle_params* p, intV* surface) {
    const wideV sum = affine(p->numerator, v, x, y);
#if TELECENTRIC
    return wide_to_float(sum);
#else
    *surface &= as_intV(wide_to_float(sum)) >= 0;
    return circle_of_inverse(sum, p);
#endif
}
#elif CIRCLE == CIRCLE_QUOTIENT
INLINE floatV circle_law(floatV v, uint x, uint y, const depth_params* depth, const ray_params* rays,
                         const circle_params* p, intV* surface) {
    const wideV below = affine(p->denominator, v, x, y);
#if !TELECENTRIC
    const floatV single = wide_to_float(below);
    *surface &= ((as_intV(single) ^ as_intV(wide_to_float(affine(p->in_front, v, x, y)))) >= 0) & (single != 0.0f);
#endif
    return wide_quotient(affine(p->numerator, v, x, y), below);
}
#else
INLINE floatV circle_law(floatV v, uint x, uint y, const depth_params* depth, const ray_params* rays,
                         const circle_params* p, intV* surface) {
    const floatV z = decode_form(v, x, y, depth, rays); // the host makes it count from the lens
#if TELECENTRIC
    const wideV sum = wide_add(wide_multiply(wide_constant(p->g), z), wide_negative(wide_constant(p->k)));
    return select(wide_to_float(sum), (floatV)p->infinite, z == INFINITY);
#else
    *surface &= z > depth->least_depth;
    const floatV c = circle_of_inverse(wide_ratio(wide_from((floatV)1.0f), wide_from(z)), p);
    return select(c, (floatV)p->infinite, z == INFINITY);
#endif
}
#endif

// Circles of V pixels: the background has the circle that the host gives, an invalid pixel has NaN.
INLINE floatV circle_of_confusion(sampleV sample, uint x, uint y, const depth_params* depth, const ray_params* rays,
                                  const circle_params* p) {
    const floatV v = sample.value;
    intV in_range = (v >= depth->lowest) & (v <= depth->highest);
#if FORM >= FORM_AFFINE // metric values may be infinite, and sums of them would be NaN
    const floatV far = depth->farther * v;
    in_range &= far > -INFINITY;
#endif
    intV surface = in_range;
    floatV c = no_larger(circle_law(v, x, y, depth, rays, p, &surface), p);
#if FORM >= FORM_AFFINE
    const intV infinite = far == INFINITY;
    c = select(c, (floatV)p->infinite, infinite);
    surface |= in_range & infinite;
#endif
    return select(select((floatV)NAN, c, surface), (floatV)p->sky, sample.background);
}

INLINE floatV circles(__global const STORED* source, const grid_params* grid, const depth_params* depth,
                      const ray_params* rays, const circle_params* p, uint x, uint y) {
    const sampleV sample = load_stored(source, grid, x, y, depth);
    return circle_of_confusion(sample, grid->pixel_x + x, grid->pixel_y + y, depth, rays, p);
}
#endif

#endif
