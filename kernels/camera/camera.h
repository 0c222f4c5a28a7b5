// From a stored value to a view depth: the device side of the camera. docs/camera.md derives it.
//   z = -(m3.q) / (m4.q),  q = (x, y, d, 1),  M = (viewport projection)^-1
// Popov 2016, eq. 1, 3 and 5-9. The host finds the simplest form that is exact (src/camera/form.cpp); the kernel is built
// for that form and for the way the value lies in memory.
// Built for: FORM = 0 1 2 3 4 5 6; STORAGE = 0 1 2 3 4 5; PIXEL_TERMS = 0 1; W_IS_DEPTH = 0 1

#ifndef FATHOM_CAMERA_H
#define FATHOM_CAMERA_H

#include "vector.h"
#include "params.h"

#if !defined(FORM) || FORM < FORM_RECIPROCAL || FORM > FORM_INVERSE_RAY_DISTANCE
#error "FORM is not defined: one of the FORM_ constants of params.h"
#endif
#if !defined(STORAGE) || STORAGE < STORAGE_FLOAT32 || STORAGE > STORAGE_UINT8
#error "STORAGE is not defined: one of the STORAGE_ constants of params.h"
#endif

#ifndef PIXEL_TERMS
#error "PIXEL_TERMS is not defined: 1 where depth depends on the pixel as well as on the stored value, 0 otherwise"
#endif
#ifndef W_IS_DEPTH
#error "W_IS_DEPTH is not defined: 1 where one step of every ray covers the same view depth, 0 otherwise"
#endif

#if STORAGE == STORAGE_FLOAT32
#define STORED float
#elif STORAGE == STORAGE_FLOAT16 || STORAGE == STORAGE_UINT16
#define STORED ushort
#elif STORAGE == STORAGE_UINT24
#define STORED uint
#else
#define STORED uchar
#if STORAGE == STORAGE_RGB8
#define STORED_PER_PIXEL 3
#endif
#endif
#ifndef STORED_PER_PIXEL
#define STORED_PER_PIXEL 1
#endif

// A stored value as a number, exactly, and whether it means the background. NaN where nothing was measured.
typedef struct {
    floatV value;
    intV background;
} sampleV;

// The number that is stored, and its bits.
INLINE floatV load_number(__global const STORED* source, const grid_params* grid, uint x, uint y, const depth_params* p,
                          uintV* bits) {
    const size_t at = grid->source_offset + (size_t)y * grid->source_stride + x * STORED_PER_PIXEL;
#if STORAGE == STORAGE_FLOAT32
    const floatV value = LOAD(float, source + at);
    *bits = as_uintV(value);
    return value;
#elif STORAGE == STORAGE_FLOAT16
    *bits = convert_uintV(LOAD(ushort, source + at));
#if V == 1
    return vload_half(at, (__global const half*)source);
#else
    return JOIN(vload_half, V)(0, (__global const half*)(source + at));
#endif
#else
#if STORAGE == STORAGE_UINT8
    *bits = convert_uintV(LOAD(uchar, source + at));
#elif STORAGE == STORAGE_UINT16
    *bits = convert_uintV(LOAD(ushort, source + at));
#elif STORAGE == STORAGE_UINT24
    *bits = (LOAD(uint, source + at) >> p->code_shift) & 0xffffffu;
#else
    uint codes[V];
    for (int i = 0; i < V; ++i) {
        __global const uchar* bytes = source + at + 3 * i;
        codes[i] = bytes[0] * p->byte_weights[0] + bytes[1] * p->byte_weights[1] + bytes[2] * p->byte_weights[2];
    }
    *bits = *(const uint_lanes*)codes;
#endif
    return convert_floatV(*bits);
#endif
}

INLINE sampleV load_stored(__global const STORED* source, const grid_params* grid, uint x, uint y,
                           const depth_params* p) {
#if STORAGE != STORAGE_RGB8
    READ_AHEAD(source + grid->source_offset + (size_t)y * grid->source_stride + x);
#endif
    sampleV sample;
    uintV bits;
    sample.value = load_number(source, grid, x, y, p, &bits);
    sample.background = (bits & p->background_mask) == p->background;
    if (p->has_special) { // the same for all pixels: its tests would cost the others a tenth
        sample.value = select(sample.value, (floatV)NAN, (bits & p->missing_mask) == p->missing);
        sample.background |= p->farther * sample.value >= p->background_from;
    }
    return sample;
}

// c[0] v + c[1] x + c[2] y + c[3]
INLINE wideV affine(const wide* c, floatV v, uint x, uint y) {
#if PIXEL_TERMS
    const wideV rest = wide_at_pixel(c + 1, x, y);
#else
    const wideV rest = wide_constant(c[3]);
#endif
    return wide_multiply_add(wide_constant(c[0]), v, rest);
}

// |direction|^2 of the pixel's ray: that of three components of which the second depends on the row alone and the third on
// nothing, a triangular matrix that is as long as the directions (QR).
INLINE wideV direction_square(uint x, uint y, const ray_params* rays) {
    const wideV first = wide_at_pixel(rays->length[0], x, y);
    const wideV second = wide_at_row(rays->length[1] + 1, y), third = wide_constant(rays->length[2][2]);
    const wideV of_row = wide_add(wide_product(second, second), wide_product(third, third));
    return wide_add(wide_product(first, first), of_row);
}

#if FORM == FORM_RECIPROCAL
// z = gain / (t + pole), t counted from the end of the range that is nearest to the pole: every term is positive, so
// nothing cancels and two floats are enough on every device. |end| >= |v| makes both differences exact.
INLINE pairV reciprocal_sum(floatV v, const depth_params* p) {
    const floatV t = fma((floatV)p->sign, v, (floatV)p->end);
    const floatV t_low = fma((floatV)p->sign, v, p->end - t);
    const floatV sum = t + p->pole_high;
    const floatV larger = max(t, p->pole_high), smaller = min(t, p->pole_high);
    return (pairV){sum, (smaller - (sum - larger)) + (t_low + p->pole_low)};
}
INLINE floatV decode_form(floatV v, uint x, uint y, const depth_params* p, const ray_params* rays) {
    return quotient_pair((pairV){(floatV)p->gain_high, (floatV)p->gain_low}, reciprocal_sum(v, p));
}
#elif FORM == FORM_RECIPROCAL_AFFINE
INLINE floatV decode_form(floatV v, uint x, uint y, const depth_params* p, const ray_params* rays) {
    return wide_reciprocal(affine(p->denominator, v, x, y));
}
#elif FORM == FORM_AFFINE
INLINE floatV decode_form(floatV v, uint x, uint y, const depth_params* p, const ray_params* rays) {
    return wide_to_float(affine(p->numerator, v, x, y));
}
#elif FORM == FORM_RATIONAL
INLINE floatV decode_form(floatV v, uint x, uint y, const depth_params* p, const ray_params* rays) {
    return wide_quotient(affine(p->numerator, v, x, y), affine(p->denominator, v, x, y));
}
#elif FORM == FORM_EXPONENTIAL
INLINE floatV decode_form(floatV v, uint x, uint y, const depth_params* p, const ray_params* rays) {
    const wideV exponent = wide_multiply_add(wide_constant(p->rate), v, wide_constant(p->start));
    return wide_exponential(exponent, p->amplitude, p->offset);
}
#else
#if FORM == FORM_INVERSE_RAY_DISTANCE
INLINE wideV inverse_distance(floatV v, const depth_params* p) {
    return wide_multiply_add(wide_constant(p->denominator[0]), v, wide_constant(p->denominator[3]));
}
#endif

// z = distance depth / |direction| + offset.
INLINE wideV ray_depth(floatV v, uint x, uint y, const depth_params* p, const ray_params* rays) {
    const wideV square = direction_square(x, y, rays);
#if FORM == FORM_RAY_DISTANCE
    wideV length = wide_multiply_add(wide_constant(p->numerator[0]), v, wide_constant(p->numerator[3]));
#else
    wideV length = wide_ratio(wide_constant(p->numerator[3]), inverse_distance(v, p));
#endif
#if !W_IS_DEPTH
    length = wide_product(wide_at_pixel(rays->depth, x, y), length);
#endif
    length = wide_over_root(length, square);
#if FORM == FORM_INVERSE_RAY_DISTANCE
    length = wide_multiply(length, (floatV)inverse_ray_unit);
#endif
    return wide_add(length, wide_constant(p->offset));
}

INLINE floatV decode_form(floatV v, uint x, uint y, const depth_params* p, const ray_params* rays) {
    const floatV z = wide_to_float(ray_depth(v, x, y, p, rays));
#if FORM == FORM_RAY_DISTANCE
    return z;
#else
    // Beyond the largest float the ratio is no number.
    const floatV small = wide_to_float(inverse_distance(v, p));
    return select(z, (floatV)INFINITY, isnan(z) & (small >= 0.0f) & (small < 1.0f));
#endif
}
#endif

// View depth of V pixels: the background becomes what the caller asked for, an invalid pixel becomes NaN.
INLINE floatV view_depth(sampleV sample, uint x, uint y, const depth_params* p, const ray_params* rays) {
    floatV z = decode_form(sample.value, x, y, p, rays);
#if FORM == FORM_RAY_DISTANCE || (FORM == FORM_AFFINE && !FP64)
    z = select(z, p->farther * sample.value, isinf(sample.value)); // infinitely far; sums of it would be NaN
#endif
    intV surface = (sample.value >= p->lowest) & (sample.value <= p->highest);
#if FORM != FORM_RECIPROCAL // all of whose depths are positive
    surface &= z > p->least_depth;
#endif
    return select(select((floatV)NAN, z, surface), (floatV)p->background_depth, sample.background);
}

#endif
