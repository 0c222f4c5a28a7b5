// Fog over a colour, from stored depth in one pass.
//   result = c + f (fog - c),   f = min(1 - exp(-tau), max_opacity),   tau = integral of the density along the ray
//   HEIGHT 0: the density is the same everywhere,             tau = density L
//   HEIGHT 1: density(h) = density exp(-falloff (h - h0)),    tau = density(lower end) (1 - exp(-kappa L)) / kappa
// L is the distance along the ray beyond `start`, and kappa = falloff |up . ray| > 0. Counted from the lower end, every factor
// is positive and no exponential overflows, whichever way the ray goes. Near kappa = 0 the quotient is L (1 - kappa L / 2).
// Of the sky L is infinite: upwards the quotient is 1 / kappa, level or downwards the fog is complete.
// All exponents are powers of two, summed in double (or two floats) where an error of theirs would be one of the density.
// Closed form: Wenzel 2006, "Real-time Atmospheric Effects in Games".
// Built for: HEIGHT = 0 1; PREMULTIPLIED = 0 1

#include "camera.h"
#include "pixels.h"
#include "store.h"

#ifndef HEIGHT
#error "HEIGHT is not defined: 1 where the density falls with the height, 0 where it is the same everywhere"
#endif
#ifndef PREMULTIPLIED
#error "PREMULTIPLIED is not defined: 1 where a colour holds its alpha multiplied in, 0 otherwise"
#endif

#define LOG2_E 1.44269504f
#define HALF_LN_2 0.34657359f

// Below this kappa L / ln 2, what the series leaves out is less than 5e-9 of the quotient.
#define SERIES 0x1p-12f

// (2^r - 1) / r for |r| <= 1/2, off by less than 2^-24 of it: the polynomial of wide_exponential, in floats.
INLINE floatV power_quotient(floatV r) {
    floatV q = (floatV)0x1.00a582p-16f;
    q = fma(q, r, (floatV)0x1.444p-13f);
    q = fma(q, r, (floatV)0x1.5d879ep-10f);
    q = fma(q, r, (floatV)0x1.3b2a1cp-7f);
    q = fma(q, r, (floatV)0x1.c6b08ep-5f);
    q = fma(q, r, (floatV)0x1.ebfbep-3f);
    return fma(q, r, (floatV)0x1.62e43p-1f);
}

INLINE floatV nearest_whole(floatV v) { // |v| < 2^22
    return (v + 0x1.8p23f) - 0x1.8p23f;
}

// 1 - 2^-v for v >= 0, within three roundings of itself: small ones keep their digits.
INLINE floatV one_less_power(floatV v) {
    const floatV least = min(v, 64.0f), n = nearest_whole(least), r = n - least;
    const floatV scale = as_floatV((127 - convert_intV(n)) << 23);
    return fma(-scale, r * power_quotient(r), 1.0f - scale);
}

#if HEIGHT
// 2^e, within three roundings; 0 below 2^-126.
INLINE floatV power(wideV e) {
    const floatV n = nearest_whole(min(max(wide_to_float(e), -200.0f), 127.0f));
    const floatV r = min(max(wide_to_float(wide_add(e, wide_negative(wide_from(n)))), -1.0f), 0.5f);
    const floatV scale = as_floatV((convert_intV(n) + 127) << 23);
    return select((floatV)0.0f, scale * fma(r, power_quotient(r), (floatV)1.0f), n >= -126.0f);
}

INLINE wideV wide_select(wideV a, wideV b, intV second) {
#if FP64
    return select(a, b, JOIN(convert_, LANES(long))(second));
#else
    return (wideV){select(a.high, b.high, second), select(a.low, b.low, second)};
#endif
}
#endif

// tau / ln 2. NaN for an invalid depth.
INLINE floatV optical_depth(floatV z, uint x, uint y, const ray_params* eye, const fog_params* p) {
    const intV sky = z == INFINITY;
    const floatV finite = select(z, (floatV)0.0f, sky);
    // The length of a direction is that of a triangular matrix, see camera.h.
    const wideV first = wide_at_pixel(eye->length[0], x, y);
    const wideV second = wide_at_row(eye->length[1] + 1, y), third = wide_constant(eye->length[2][2]);
    const wideV of_row = wide_add(wide_product(second, second), wide_product(third, third));
    const wideV square = wide_add(wide_product(first, first), of_row);
    const wideV inverse = wide_over_root(wide_from((floatV)1.0f), square);
    wideV steps = wide_add(wide_from(finite), wide_negative(wide_constant(eye->eye_depth)));
#if !W_IS_DEPTH
    steps = wide_from(wide_quotient(steps, wide_at_pixel(eye->depth, x, y)));
#endif
    const wideV distance = wide_product(wide_product(steps, square), inverse);
    const wideV beyond = wide_add(distance, wide_negative(wide_constant(p->start)));
#if HEIGHT
    const wideV rate = wide_product(wide_at_pixel(p->per_step, x, y), inverse); // of log2 of the density, per length
    const floatV gains = wide_to_float(rate), kappa = fabs(gains);
    const intV down = gains > 0.0f;
    const wideV to_lower_end = wide_select(wide_constant(p->start), distance, down);
    const floatV density = power(wide_add(wide_at_pixel(p->at_eye, x, y), wide_product(rate, to_lower_end)));
    const floatV length = max(wide_to_float(beyond), 0.0f), falls = kappa * length;
    const floatV series = length * fma((floatV)-HALF_LN_2, falls, (floatV)1.0f);
    const floatV quotient = LOG2_E * (one_less_power(falls) / kappa);
    const floatV to_surface = density * select(quotient, series, falls < SERIES);
    const floatV to_sky = select((floatV)p->sky, density * (LOG2_E / kappa), gains < 0.0f);
#else
    const floatV to_surface = wide_to_float(wide_product(wide_constant(p->density), beyond));
    const floatV to_sky = p->sky;
#endif
    return select(select(max(to_surface, 0.0f), to_sky, sky), (floatV)NAN, z != z);
}

// What the pixels of V elements have, the j-th V of CHANNELS V of them.
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

// The fog's colour, and which elements are an alpha, which no fog changes.
INLINE floatV color_of(const fog_params* p, int j) {
    float elements[V];
    for (int i = 0; i < V; ++i)
        elements[i] = p->color[(j * V + i) % CHANNELS];
    return *(const float_lanes*)elements;
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

// V elements from here on; integers count from 0 to 1. The same as pixels.h has them, one by one.
INLINE floatV load_elements(__global const ELEMENT_TYPE* from) {
#if ELEMENT == ELEMENT_FLOAT
    return LOAD(float, from);
#elif V == 1
    return read_element(from, 0);
#elif ELEMENT == ELEMENT_HALF
    return JOIN(vload_half, V)(0, (__global const half*)from);
#elif ELEMENT == ELEMENT_U16
    return convert_floatV(JOIN(vload, V)(0, from)) / 65535.0f;
#else
    return convert_floatV(JOIN(vload, V)(0, from)) / 255.0f;
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
    JOIN(vstore, V)(JOIN(convert_, LANES(ushort))(min(max(value, 0.0f), 1.0f) * 65535.0f + 0.5f), 0, to);
#else
    JOIN(vstore, V)(JOIN(convert_, LANES(uchar))(min(max(value, 0.0f), 1.0f) * 255.0f + 0.5f), 0, to);
#endif
}

__kernel void fog(__global const STORED* source, __global const ELEMENT_TYPE* color, __global ELEMENT_TYPE* target,
                  const grid_params grid, const source_params color_source, const depth_params depth,
                  const ray_params rays, const ray_params eye, const fog_params p) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    const floatV z = view_depth(load_stored(source, &grid, x, y, &depth), px, py, &depth, &rays);
    floatV f = min(one_less_power(optical_depth(z, px, py, &eye, &p)), p.max_opacity);
    f = select(f, (floatV)0.0f, (z != z) | ((z == INFINITY) & (intV)(int)p.keep_sky));

    __global const ELEMENT_TYPE* from = color + color_source.offset + (size_t)y * color_source.stride + CHANNELS * x;
    __global ELEMENT_TYPE* to = target + grid.target_offset + (size_t)y * grid.target_stride + CHANNELS * x;
    floatV colors[CHANNELS];
    for (int j = 0; j < CHANNELS; ++j) {
        READ_AHEAD(from + j * V);
        colors[j] = load_elements(from + j * V);
    }
#pragma unroll
    for (int j = 0; j < CHANNELS; ++j) {
        const floatV c = colors[j], share = of_elements(f, j);
        floatV fog_color = color_of(&p, j);
        intV fogged = (share > 0.0f) & (fabs(c) < INFINITY);
#if CHANNELS == 4
        fogged &= ~is_alpha(j);
#if PREMULTIPLIED
        fog_color *= alpha_of(colors, j);
#endif
#endif
        const floatV mixed = select(fma(share, fog_color - c, c), fog_color, share == 1.0f); // complete fog is exact
        store_elements(select(c, mixed, fogged), to + j * V);
    }
}
