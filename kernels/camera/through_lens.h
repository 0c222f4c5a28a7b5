// Depth that was stored through a lens: how far V pixels' surfaces lie from the camera centre, and their rays. See patch.h.
// Built for: ALONG = 0 1 2

#ifndef FATHOM_THROUGH_LENS_H
#define FATHOM_THROUGH_LENS_H

#include "camera/camera.h"
#include "camera/patch.h"

#if LENS
#if !defined(ALONG) || ALONG < ALONG_AXIS || ALONG > ALONG_CUBE
#error "ALONG is not defined: one of the ALONG_ constants of params.h, which say along what a depth counts"
#endif

#if ALONG == ALONG_CUBE
// The greatest component of a ray in the axes of view space, without its sign.
INLINE pairV part_along_cube(const patch_rayV* ray, const lens_params* lens) {
    pairV largest = {(floatV)0.0f, (floatV)0.0f};
    for (int i = 0; i < 3; ++i) {
        const wide* const row = lens->to_view[i];
        const wideV across = wide_product(wide_constant(row[0]), wide_of_pair(ray->x));
        const wideV both = wide_add(across, wide_product(wide_constant(row[1]), wide_of_pair(ray->y)));
        const wideV part = wide_add(both, wide_product(wide_constant(row[2]), wide_of_pair(ray->z)));
        const floatV high = wide_to_float(part), low = wide_to_float(wide_add(part, wide_negative(wide_from(high))));
        const intV larger = fabs(high) > largest.high;
        largest.high = select(largest.high, fabs(high), larger);
        largest.low = select(largest.low, select(low, -low, high < 0.0f), larger);
    }
    return largest;
}
#endif

// The distance from the camera centre of a decoded depth.
INLINE floatV patch_distance(floatV depth, const patch_rayV* ray, const lens_params* lens) {
#if ALONG == ALONG_AXIS
    const floatV distance = quotient_pair((pairV){depth, (floatV)0.0f}, ray->ahead);
    return select((floatV)NAN, select(distance, depth, isinf(depth)), ray->ahead.high >= lens->least_ahead);
#else
#if ALONG == ALONG_CUBE
    const floatV distance = quotient_pair((pairV){depth, (floatV)0.0f}, part_along_cube(ray, lens));
    depth = select(distance, depth, isinf(depth));
#endif
    return select(depth, (floatV)NAN, isnan(ray->ahead.high));
#endif
}

// The inverse of that distance, of V pixels of the image.
INLINE floatV inverse_through_lens(__global const STORED* source, __global const uint* tiles, __global const float* nodes,
                                   const grid_params* grid, const depth_params* depth, const lens_params* lens, uint x,
                                   uint y) {
    const uint px = grid->pixel_x + x, py = grid->pixel_y + y;
    const floatV stored = view_depth(load_stored(source, grid, x, y, depth), px, py, depth, 0);
#if ALONG == ALONG_RAY
    return select((floatV)NAN, 1.0f / stored, have_rays(tiles, nodes, lens, px, py));
#else
    const patch_rayV ray = patch_rays(tiles, nodes, lens, px, py);
#if ALONG == ALONG_AXIS
    return select((floatV)NAN, ray.ahead.high / stored, ray.ahead.high >= lens->least_ahead);
#else
    return 1.0f / patch_distance(stored, &ray, lens);
#endif
#endif
}

// V pixels of a depth that was stored through a lens.
typedef struct {
    intV background;
    floatV stored;   // decoded, along whatever it counts
    floatV distance; // along the ray; infinite for the background, NaN where there is no depth or no ray
    patch_rayV ray;
} lens_pixelV;

// x, y: in the image.
INLINE lens_pixelV lens_pixels(__global const STORED* source, __global const uint* tiles, __global const float* nodes,
                               const grid_params* grid, const depth_params* depth, const lens_params* lens, uint x,
                               uint y) {
    const uint px = grid->pixel_x + x, py = grid->pixel_y + y;
    const sampleV sample = load_stored(source, grid, x, y, depth);
    lens_pixelV pixel;
    pixel.background = sample.background;
    pixel.stored = view_depth(sample, px, py, depth, 0);
    pixel.ray = patch_rays(tiles, nodes, lens, px, py);
    pixel.distance = patch_distance(pixel.stored, &pixel.ray, lens);
    return pixel;
}

// The distance along the view axis.
INLINE floatV along_axis(const lens_pixelV* pixel, const lens_params* lens) {
#if ALONG == ALONG_AXIS
    return select((floatV)NAN, pixel->stored, pixel->ray.ahead.high >= lens->least_ahead);
#else
    const floatV ahead = fma(pixel->distance, pixel->ray.ahead.high, pixel->distance * pixel->ray.ahead.low);
    return select(ahead, pixel->distance, isinf(pixel->distance)); // infinitely far on either side of the camera
#endif
}
#endif

#endif
