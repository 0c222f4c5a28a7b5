// Fog over a colour, from stored depth in one pass.
//   result = c + f (fog - c),   f = min(1 - exp(-tau), max_opacity),   tau = integral of the density along the ray
//   HEIGHT 0: the density is the same everywhere,             tau = density L
//   HEIGHT 1: density(h) = density exp(-falloff (h - h0)),    tau = density(lower end) (1 - exp(-kappa L)) / kappa
// L is the distance along the ray beyond `start`, and kappa = falloff |up . ray| > 0. Counted from the lower end, every factor
// is positive and no exponential overflows, whichever way the ray goes. L is infinite for the sky: upwards the quotient
// is 1 / kappa, level or downwards the fog is complete. Through a lens a step of the ray is one unit long.
// All exponents are powers of two, summed in double (or two floats) where an error of theirs would be one of the density.
// Closed form: Wenzel 2006, "Real-time Atmospheric Effects in Games".
// Built for: HEIGHT = 0 1; PREMULTIPLIED = 0 1; START = 0 1

#include "camera/through_lens.h"
#include "pixels.h"
#include "store.h"

#ifndef HEIGHT
#error "HEIGHT is not defined: 1 where the density falls with the height, 0 where it is the same everywhere"
#endif
#ifndef PREMULTIPLIED
#error "PREMULTIPLIED is not defined: 1 where a colour holds its alpha multiplied in, 0 otherwise"
#endif
#ifndef START
#error "START is not defined: 1 where the fog begins at a distance, 0 where it begins at the camera centre"
#endif

#define LOG2_E 1.44269504f

// Added to the slope, so that a level ray does not divide by 0; it is too small to change any other.
#define LEVEL 1e-30f

// (2^r - 1) / r for |r| <= 1/2, off by less than 2^-24 of it: the polynomial of wide_exponential, in floats. In pairs of
// terms (Estrin): this kernel waits for its longest chain of operations, not for their number.
INLINE floatV power_quotient(floatV r) {
    const floatV square = r * r;
    const floatV first = fma(r, (floatV)0x1.ebfbep-3f, (floatV)0x1.62e43p-1f);
    const floatV second = fma(r, (floatV)0x1.3b2a1cp-7f, (floatV)0x1.c6b08ep-5f);
    const floatV third = fma(r, (floatV)0x1.444p-13f, (floatV)0x1.5d879ep-10f);
    const floatV high = fma(square, fma(square, (floatV)0x1.00a582p-16f, third), second);
    return fma(square, high, first);
}

// A depth that stands for the sky's, so that no sum or product of it is NaN.
#define FAR 1e30f

// Adding this rounds a float to the nearest integer and leaves that in the low bits.
#define WHOLE 0x1.8p23f

// 1 - 2^-v for v >= 0, within three roundings of itself: small ones keep their digits.
INLINE floatV one_less_power(floatV v) {
    const floatV least = min((floatV)64.0f, v), rounded = least + WHOLE;
    const floatV r = (rounded - WHOLE) - least, scale = as_floatV(0x3f800000 - (as_intV(rounded) << 23));
    return fma(-scale * r, power_quotient(r), 1.0f - scale);
}

#if HEIGHT
INLINE wideV at_least_0(wideV a) {
#if FP64
    return max(a, (wideV)0.0);
#else
    const intV positive = a.high > 0.0f;
    return (wideV){select((floatV)0.0f, a.high, positive), select((floatV)0.0f, a.low, positive)};
#endif
}

// 2^e, within three roundings; 0 below 2^-126, and at most 2^127.
INLINE floatV power(wideV e) {
#if FP64
    const wideV within = min(e, (wideV)127.0), whole = (within + 0x1.8p52) - 0x1.8p52;
    const floatV n = wide_to_float(whole), r = wide_to_float(within - whole);
#else
    const floatV n = (min(max(wide_to_float(e), -0x1p22f), 127.0f) + WHOLE) - WHOLE;
    const floatV r = min(wide_to_float(wide_add(e, wide_from(-n))), 0.5f);
#endif
    const floatV scale = as_floatV((as_intV(min(max(n, -126.0f), 127.0f) + WHOLE) << 23) + 0x3f800000);
    return select((floatV)0.0f, fma(scale * r, power_quotient(r), scale), n >= -126.0f);
}
#endif

#if LENS
// tau / ln 2 at a distance along the ray, which may be infinite. `up`: the ray's rise to a unit of its length.
INLINE floatV optical_depth(floatV distance, pairV up, const fog_params* p) {
    const intV sky = distance == INFINITY;
    const floatV length = (floatV)1.0f;
    wideV way = wide_from(select(distance, (floatV)FAR, sky));
#if START
    const wideV clear = wide_constant(p->start);
    way = wide_add(way, wide_negative(clear));
#endif
#if HEIGHT
    const wideV slope = wide_product(wide_constant(p->per_step[1]), wide_of_pair(up));
    const wideV at_centre = wide_constant(p->at_centre[2]);
#endif
#else
// tau / ln 2 at view depth z, which may be infinite.
INLINE floatV optical_depth(floatV z, uint x, uint y, const ray_params* centred, const fog_params* p) {
    const intV sky = z == INFINITY;
    // The length of a direction is that of a triangular matrix, see camera.h.
    const wideV first = wide_at_pixel(centred->length[0], x, y);
    const wideV second = wide_at_row(centred->length[1] + 1, y), third = wide_constant(centred->length[2][2]);
    const wideV of_row = wide_add(wide_product(second, second), wide_product(third, third));
    // The way to the surface, counted in steps of the direction.
    wideV way = wide_add(wide_from(select(z, (floatV)FAR, sky)), wide_negative(wide_constant(centred->centre_depth)));
#if !W_IS_DEPTH
    const wideV per_step = wide_at_pixel(centred->depth, x, y);
    const floatV whole = wide_quotient(way, per_step);
    const wideV rest = wide_add(way, wide_negative(wide_multiply(per_step, whole)));
    way = wide_add(wide_from(whole), wide_from(wide_quotient(rest, per_step)));
#endif
#if START
    const wideV square = wide_add(wide_product(first, first), of_row);
    const wideV inverse = wide_over_root(wide_from((floatV)1.0f), square);
    const floatV length = wide_to_float(wide_product(square, inverse));
    const wideV clear = wide_product(wide_constant(p->start), inverse);
    way = wide_add(way, wide_negative(clear));
#else
    const floatV across = wide_to_float(first), square = fma(across, across, wide_to_float(of_row));
    const floatV inverse = inverse_root_guess(square), guess = square * inverse;
    const floatV length = fma(0.5f * guess, fma(-guess, inverse, (floatV)1.0f), guess);
#endif
#if HEIGHT
    const wideV slope = wide_at_pixel(p->per_step, x, y); // of log2 of the density
    const wideV at_centre = wide_at_pixel(p->at_centre, x, y);
#endif
#endif
    const floatV steps = max(wide_to_float(way), 0.0f);
#if HEIGHT
    wideV lower_end = wide_add(at_centre, at_least_0(wide_product(slope, way)));
#if START
    lower_end = wide_add(lower_end, wide_product(slope, clear));
#endif
    const floatV gain = wide_to_float(slope), loss = fabs(gain) + LEVEL;
    const floatV falls = select(loss * steps, (floatV)INFINITY, sky);
    const floatV tau = power(lower_end) * (LOG2_E * one_less_power(falls) * (length / loss));
    return select(tau, (floatV)p->sky, sky & (gain >= 0.0f));
#else
    return select(p->density * (length * steps), (floatV)p->sky, sky);
#endif
}

// Repeats each pixel's value for its channels: the j-th vector of V elements out of CHANNELS.
INLINE floatV of_elements(floatV of_pixels, int j) {
#if V == 1
    return of_pixels;
#elif V == 16 && CHANNELS == 3
    return j == 0   ? SHUFFLE(of_pixels, of_pixels, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 5)
           : j == 1 ? SHUFFLE(of_pixels, of_pixels, 5, 5, 6, 6, 6, 7, 7, 7, 8, 8, 8, 9, 9, 9, 10, 10)
                    : SHUFFLE(of_pixels, of_pixels, 10, 11, 11, 11, 12, 12, 12, 13, 13, 13, 14, 14, 14, 15, 15, 15);
#elif V == 16
    return j == 0   ? SHUFFLE(of_pixels, of_pixels, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3)
           : j == 1 ? SHUFFLE(of_pixels, of_pixels, 4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7)
           : j == 2 ? SHUFFLE(of_pixels, of_pixels, 8, 8, 8, 8, 9, 9, 9, 9, 10, 10, 10, 10, 11, 11, 11, 11)
                    : SHUFFLE(of_pixels, of_pixels, 12, 12, 12, 12, 13, 13, 13, 13, 14, 14, 14, 14, 15, 15, 15, 15);
#else
    const float_lanes pixels = of_pixels;
    float elements[V];
    for (int i = 0; i < V; ++i)
        elements[i] = ((const float*)&pixels)[(j * V + i) / CHANNELS];
    return *(const float_lanes*)elements;
#endif
}

// The fog's colour for the j-th vector of elements; is_alpha says which elements are an alpha, which fog does not
// change.
INLINE floatV color_of(const fog_params* p, int j) {
    const uintV channel = (LANE_INDEX(uint) + (uint)(j * V)) % CHANNELS;
    const floatV red_green = select((floatV)p->color[0], (floatV)p->color[1], channel == 1);
    return select(red_green, (floatV)p->color[2], channel == 2);
}
#if CHANNELS == 4
INLINE intV is_alpha(int j) {
#if V == 1
    return -(j == 3);
#else
    return (LANE_INDEX(int) & 3) == 3;
#endif
}

#if PREMULTIPLIED
// The alpha of each element's pixel.
INLINE floatV alpha_of(const floatV* colors, int j) {
#if V == 1
    return colors[3];
#elif V == 16
    return SHUFFLE(colors[j], colors[j], 3, 3, 3, 3, 7, 7, 7, 7, 11, 11, 11, 11, 15, 15, 15, 15);
#else
    const float_lanes all = colors[j];
    float elements[V];
    for (int i = 0; i < V; ++i)
        elements[i] = ((const float*)&all)[i / 4 * 4 + 3];
    return *(const float_lanes*)elements;
#endif
}
#endif
#endif

// Reads V elements; integers count from 0 to 1. The values are those of read_element in pixels.h.
INLINE floatV load_elements(__global const ELEMENT_TYPE* from) {
#if ELEMENT == ELEMENT_FLOAT
    return LOAD(float, from);
#elif V == 1
    return read_element(from, 0);
#elif ELEMENT == ELEMENT_HALF
    return JOIN(vload_half, V)(0, (__global const half*)from);
#elif ELEMENT == ELEMENT_U16
    return convert_floatV(LOAD(ushort, from)) / 65535.0f;
#else
    return convert_floatV(LOAD(uchar, from)) / 255.0f;
#endif
}

INLINE void store_elements(floatV value, __global ELEMENT_TYPE* to) {
#if ELEMENT == ELEMENT_FLOAT
    store_float(value, to);
#elif V == 1
    write_element(value, to, 0);
#elif ELEMENT == ELEMENT_HALF
    JOIN(JOIN(vstore_half, V), _rte)(value, 0, (__global half*)to);
#elif ELEMENT == ELEMENT_U16
    value = min(max(value, 0.0f), 1.0f);
    *(__global ushort_lanes*)to = JOIN(convert_, LANES(ushort))(CODE_OF(floatV, value, 65535.0f));
#else
    value = min(max(value, 0.0f), 1.0f);
    *(__global uchar_lanes*)to = JOIN(convert_, LANES(uchar))(CODE_OF(floatV, value, 255.0f));
#endif
}

KERNEL void fog(__global const STORED* source, __global const ELEMENT_TYPE* color, __global ELEMENT_TYPE* target,
                  const grid_params grid, const source_params color_source, const depth_params depth,
                  const ray_params rays, const ray_params centred, const fog_params p LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

#if LENS
    const lens_pixelV pixel = lens_pixels(source, tiles, nodes, &grid, &depth, &lens, x, y);
    const floatV z = pixel.distance, tau = optical_depth(z, pixel.ray.y, &p);
#else
    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    const floatV z = view_depth(load_stored(source, &grid, x, y, &depth), px, py, &depth, &rays);
    const floatV tau = optical_depth(z, px, py, &centred, &p);
#endif
    floatV f = min(one_less_power(tau), p.max_opacity);
    f = select(f, (floatV)0.0f, (z != z) | ((z == INFINITY) & (intV)(int)p.keep_sky));

    __global const ELEMENT_TYPE* from = color + color_source.offset + (size_t)y * color_source.stride + CHANNELS * x;
    __global ELEMENT_TYPE* to = target + grid.target_offset + (size_t)y * grid.target_stride + CHANNELS * x;
    floatV colors[CHANNELS];
#pragma unroll
    for (int j = 0; j < CHANNELS; ++j) {
        READ_AHEAD(from + j * V);
        colors[j] = load_elements(from + j * V);
    }
#pragma unroll
    for (int j = 0; j < CHANNELS; ++j) {
        const floatV c = colors[j], fraction = of_elements(f, j);
        floatV fog_color = color_of(&p, j);
        intV fogged = fabs(c) < INFINITY;
#if CHANNELS == 4
        fogged &= ~is_alpha(j);
#if PREMULTIPLIED
        fog_color *= alpha_of(colors, j);
#endif
#endif
        store_elements(select(c, fma(fraction, fog_color, c * (1.0f - fraction)), fogged), to + j * V);
    }
}
