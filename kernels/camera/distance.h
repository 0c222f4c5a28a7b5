// Distance from the camera centre along a pixel's ray, from a stored value: (z - centre depth) |D| / D_z, with D the ray's
// direction.

#ifndef FATHOM_DISTANCE_H
#define FATHOM_DISTANCE_H

#include "camera/camera.h"

// View depth, before it is rounded to a float.
INLINE wideV wide_depth(floatV v, uint x, uint y, const depth_params* p, const ray_params* rays) {
#if FORM == FORM_RECIPROCAL
    return wide_ratio(wide_of_pair((pairV){(floatV)p->gain_high, (floatV)p->gain_low}),
                      wide_of_pair(reciprocal_sum(v, p)));
#elif FORM == FORM_RECIPROCAL_AFFINE
    return wide_ratio(wide_from((floatV)1.0f), affine(p->denominator, v, x, y));
#elif FORM == FORM_AFFINE
    return affine(p->numerator, v, x, y);
#elif FORM == FORM_RATIONAL
    return wide_ratio(affine(p->numerator, v, x, y), affine(p->denominator, v, x, y));
#elif FORM == FORM_EXPONENTIAL
    return wide_from(decode_form(v, x, y, p, rays));
#else
    return ray_depth(v, x, y, p, rays);
#endif
}

// `z`: the same pixel's view depth, which says what is invalid and what infinitely far.
INLINE floatV ray_distance(floatV v, floatV z, uint x, uint y, const depth_params* p, const ray_params* rays) {
    const wideV square = direction_square(x, y, rays);
    const wideV centre = wide_constant(rays->centre_depth);
    wideV ahead = wide_add(wide_depth(v, x, y, p, rays), wide_negative(centre));
#if !W_IS_DEPTH
    ahead = wide_ratio(ahead, wide_at_pixel(rays->depth, x, y));
#endif
    const floatV distance = wide_to_float(wide_over_root(wide_product(ahead, square), square));
    return select(distance, z, isnan(z) | isinf(z));
}

#endif
