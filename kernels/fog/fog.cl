// Fog over a colour, from stored depth in one pass.
//   result = c + f (fog - c),   f = min(1 - exp(-tau), max_opacity),   tau = integral of the density along the ray
//   HEIGHT 0: the density is the same everywhere,             tau = density L
//   HEIGHT 1: density(h) = density exp(-falloff (h - h0)),    tau = density(lower end) (1 - exp(-kappa L)) / kappa
// L is the distance along the ray beyond `start`, and kappa = falloff |up . ray| > 0. Counted from the lower end, every factor
// is positive and no exponential overflows, whichever way the ray goes. L is infinite for the sky: upwards the quotient
// is 1 / kappa, level or downwards the fog is complete. Through a lens a step of the ray is one unit long.
// A pixel at an edge in depth may have two colours, of which each gets its own fog: see two_colors.h.
// All exponents are powers of two, summed in double (or two floats) where an error of theirs would be one of the density.
// Closed form: Wenzel 2006, "Real-time Atmospheric Effects in Games".
// Built for: HEIGHT = 0 1; PREMULTIPLIED = 0 1; START = 0 1

#include "camera/through_lens.h"
#include "fog/two_colors.h"
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

// The same where two such depths are multiplied.
#define FAR_AWAY 1e15f

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

// What pixels are decoded from.
typedef struct {
    __global const STORED* source;
    const grid_params* grid;
    const depth_params* depth;
    const ray_params *rays, *centred;
    const fog_params* fog;
#if LENS
    __global const uint* tiles;
    __global const float* nodes;
    const lens_params* lens;
#endif
} fog_source;

// The fog's part of V pixels: NaN where there is no depth.
INLINE floatV fog_part(const fog_source* of, uint x, uint y) {
    const fog_params* const p = of->fog;
#if LENS
    const lens_pixelV pixel = lens_pixels(of->source, of->tiles, of->nodes, of->grid, of->depth, of->lens, x, y);
    const floatV z = pixel.distance, tau = optical_depth(z, pixel.ray.y, p);
#else
    const uint px = of->grid->pixel_x + x, py = of->grid->pixel_y + y;
    const floatV z = view_depth(load_stored(of->source, of->grid, x, y, of->depth), px, py, of->depth, of->rays);
    const floatV tau = optical_depth(z, px, py, of->centred, p);
#endif
    const floatV f = min(one_less_power(tau), p->max_opacity);
    return select(select(f, (floatV)0.0f, (z == INFINITY) & (intV)(int)p->keep_sky), (floatV)NAN, z != z);
}

// A length that a stored value means, or its inverse, up to a factor: enough to see an edge, and soon done. What changes with the
// pixel alone is left out, since it does so as on a plane.
#define IS_INVERSE (FORM == FORM_RECIPROCAL || FORM == FORM_RECIPROCAL_AFFINE || FORM == FORM_INVERSE_RAY_DISTANCE)
INLINE floatV rough_length(const fog_source* of, uint x, uint y) {
    uintV bits;
    const floatV v = load_number(of->source, of->grid, x, y, of->depth, &bits);
#if FORM == FORM_RATIONAL || FORM == FORM_EXPONENTIAL
    const floatV rough = decode_form(v, of->grid->pixel_x + x, of->grid->pixel_y + y, of->depth, of->rays);
#else
    const floatV rough = fma((floatV)of->fog->rough_scale, v, (floatV)of->fog->rough_offset);
#endif
    return select((floatV)FAR_AWAY, rough, fabs(rough) < FAR_AWAY); // what is no number is far, too
}

// Does the inverse depth bend so much from one neighbour over the pixel to the other?
INLINE intV bends(floatV before, floatV here, floatV after, float least) {
#if IS_INVERSE
    return fabs(fma((floatV)-2.0f, here, before + after)) > least * fabs(here);
#else
    const floatV both = before * after;
    return fabs(fma(here, before + after, -2.0f * both)) > least * fabs(both);
#endif
}

// Which of V pixels lie at an edge in depth? Outside of the image is what lies at its border.
INLINE intV at_edge(const fog_source* of, uint x, uint y, uint width) {
    const float least = of->fog->least_bend;
    const floatV here = rough_length(of, x, y);
    const floatV above = rough_length(of, x, y > 0 ? y - 1 : y);
    const floatV below = rough_length(of, x, y + 1 < of->grid->height ? y + 1 : y);
    floatV before = here, after = here;
    if (x == 0 || x + V >= width) {
        float row[V + 2];
        *(float_lanes*)(row + 1) = here;
        row[0] = row[1];
        row[V + 1] = row[V];
        before = *(const float_lanes*)row;
        after = *(const float_lanes*)(row + 2);
    }
    if (x > 0)
        before = rough_length(of, x - 1, y);
    if (x + V < width)
        after = rough_length(of, x + 1, y);
    return bends(before, here, after, least) | bends(above, here, below, least);
}

// The fog's part of what lies within two pixels of V pixels; outside of the image is what lies at its border.
INLINE void fog_around(const fog_source* of, uint x, uint y, uint width, float* found) {
    const bool is_inside = x >= 2 && x + V + 2 <= width;
    for (int row = 0; row < AROUND; ++row) {
        const uint at_row = (uint)clamp((int)y + row - 2, 0, (int)of->grid->height - 1);
        for (int first = 0; first < ROW; first += V) {
            const int begin = (int)x + min(first, ROW - V) - 2, inside = clamp(begin, 0, (int)width - V);
            float fog[V];
            *(float_lanes*)fog = fog_part(of, (uint)inside, at_row);
            for (int i = 0; i < V; ++i)
                found[ROW * row + begin + 2 - (int)x + i] = fog[is_inside ? i : clamp(begin + i - inside, 0, V - 1)];
        }
    }
}

// Writes a pixel that has two colours.
INLINE void lay_over_both(const pixels_around* p, const other_side* of, const fog_params* fog,
                          __global ELEMENT_TYPE* target, size_t at) {
    const float rest = 1.0f - of->part, own_fog = p->fog[HERE], other_fog = p->fog[of->other];
    float here[CHANNELS], one[CHANNELS], other[CHANNELS];
    color_around(p, HERE, here);
    color_around(p, of->own, one);
    color_around(p, of->other, other);
    float own_alpha = 1.0f, other_alpha = 1.0f;
    for (int k = CHANNELS - 1; k >= 0; --k) { // alpha first
        const float own = between(fma(-of->part, other[k], here[k]) / rest, here[k], one[k]);
        const float beyond = between(fma(-rest, own, here[k]) / of->part, here[k], other[k]);
        if (k == 3) { // which stays as it is
#if PREMULTIPLIED
            own_alpha = own;
            other_alpha = beyond;
#endif
            continue;
        }
        const float own_value = fma(own_fog, fog->color[k] * own_alpha, own * (1.0f - own_fog));
        const float other_value = fma(other_fog, fog->color[k] * other_alpha, beyond * (1.0f - other_fog));
        const float value = fma(of->part, other_value, rest * own_value);
        if (fabs(value) < INFINITY)
            write_element(value, target, at + k);
    }
}

KERNEL void fog(__global const STORED* source, __global const ELEMENT_TYPE* color, __global ELEMENT_TYPE* target,
                const grid_params grid, const source_params color_source, const depth_params depth,
                const ray_params rays, const ray_params centred, const fog_params p LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

    const fog_source of = {
        source,
        &grid,
        &depth,
        &rays,
        &centred,
        &p
#if LENS
        ,
        tiles,
        nodes,
        &lens
#endif
    };
    floatV f = fog_part(&of, x, y);
    f = select(f, (floatV)0.0f, f != f);

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

    if (p.least_bend == INFINITY)
        return;
    const intV edge = at_edge(&of, x, y, grid.x_end);
    if (!any_of(edge))
        return;
    uint lanes[V];
    *(uint_lanes*)lanes = as_uintV(edge);
    float beside[ROW * AROUND];
    fog_around(&of, x, y, grid.x_end, beside);
    for (uint i = 0; i < V; ++i)
        if (lanes[i] != 0) {
            const pixels_around around = {beside + i, color, color_source.offset, color_source.stride,
                                          x + i,      y,     grid.x_end,          grid.height};
            const other_side other = look_around(&around);
            if (other.part > 0.0f)
                lay_over_both(&around, &other, &p, target,
                              grid.target_offset + (size_t)y * grid.target_stride + (size_t)(CHANNELS * (x + i)));
        }
}
