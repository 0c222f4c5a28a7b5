// V neighbouring pixels per work-item: vector types, loads, stores, and sums that keep more than a float.
//
// PoCL vectorises straight-line kernels only, so the lanes are explicit: V = 16 or 8 on a CPU, 1 on a GPU, one source.
// No transcendental builtin is used, and products are fused only where `fma` says so: the same bits come out for
// every V and host.
// Built for: V = 1 4 8 16; FP64 = 0 1; STREAM = 0 1; CLANG_BUILTINS = 0 1

#ifndef FATHOM_VECTOR_H
#define FATHOM_VECTOR_H

#include "builtins.h"
#include "params.h"

#ifndef V
#error "V, the pixels per work-item, is not defined: 1, 4, 8 or 16"
#endif
#ifndef FP64
#error "FP64 is not defined: 1 where the device has double, 0 for sums of two floats"
#endif
#ifndef STREAM
#error "STREAM is not defined: 1 to write past the cache (aligned images larger than it), 0 otherwise"
#endif

#ifndef CLANG_BUILTINS
#error "CLANG_BUILTINS is not defined: 1 where the driver is known to compile those that are used, 0 otherwise"
#endif

#pragma OPENCL FP_CONTRACT OFF
#define INLINE static inline __attribute__((always_inline)) // what depends on the row alone then leaves PoCL's loops
#if FP64
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#endif

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#if V == 1
#define LANES(type) type
#define LANE_INDEX(type) ((type)0)
#elif V == 4
#define LANES(type) JOIN(type, V)
#define LANE_INDEX(type) ((LANES(type))(0, 1, 2, 3))
#elif V == 8
#define LANES(type) JOIN(type, V)
#define LANE_INDEX(type) ((LANES(type))(0, 1, 2, 3, 4, 5, 6, 7))
#elif V == 16
#define LANES(type) JOIN(type, V)
#define LANE_INDEX(type) ((LANES(type))(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#else
#error "V must be 1, 4, 8 or 16"
#endif

typedef LANES(float) floatV;
typedef LANES(int) intV;
typedef LANES(uint) uintV;
typedef LANES(ushort) ushortV;
typedef LANES(uchar) ucharV;
// A driver that packs work-items into vectors leaves alone what says that it is made of vectors already.
#define KERNEL __kernel __attribute__((vec_type_hint(floatV)))
#define as_floatV JOIN(as_, LANES(float))
#define as_intV JOIN(as_, LANES(int))
#define as_uintV JOIN(as_, LANES(uint))
#define convert_floatV JOIN(convert_, LANES(float))
#define convert_intV JOIN(convert_, LANES(int))
#define convert_uintV JOIN(convert_, LANES(uint))

// One vector at any element's address. vloadN and vstoreN would do; PoCL splits a vstore16 into three.
typedef floatV __attribute__((aligned(4))) float_lanes;
typedef intV __attribute__((aligned(4))) int_lanes;
typedef uintV __attribute__((aligned(4))) uint_lanes;
typedef ushortV __attribute__((aligned(2))) ushort_lanes;
typedef ucharV __attribute__((aligned(1))) uchar_lanes;
#define LOAD(type, pointer) (*(__global const JOIN(type, _lanes)*)(pointer))

// Asks for what a later work-item will read, where the processor's own guess comes too late. The host knows which drivers
// compile it: Mesa's ends the process, though its __has_builtin says yes.
#if V > 1 && CLANG_BUILTINS
#define PREFETCH(pointer) __builtin_prefetch((const void*)(size_t)(pointer), 0, 3)
#else
#define PREFETCH(pointer)
#endif

// The rows of an image are too short for that guess. In elements; twice the distance changes nothing, a quarter loses a third
// of the gain.
#define READ_AHEAD(pointer) PREFETCH((pointer) + 2048)
// The last of what the next work-item to the right reads, of what this one reads from `pointer` on.
#define READ_NEXT(pointer) PREFETCH((pointer) + 2 * V - 1)

INLINE void store_float(floatV value, __global float* target) {
#if STREAM && V > 1 && CLANG_BUILTINS
    __builtin_nontemporal_store(value, (__global floatV*)target);
#else
    *(__global float_lanes*)target = value;
#endif
}

// First column of this work-item, or x_end where there is none. The last group of a row starts at x_end - V and
// repeats some of its neighbour's work, so that no lane needs a mask.
INLINE uint first_column(uint x_begin, uint x_end) {
    const uint x = x_begin + (uint)get_global_id(0) * V;
    return x < x_end ? min(x, x_end - V) : x_end;
}

// The lanes of the work-item at column x, of columns from 0 on, that no other has: from this one on.
INLINE uint first_own_lane(uint x) {
    return (uint)get_global_id(0) * V - x;
}

// Pixel (x, y) of an image that lies there.
INLINE size_t element_at(const place_params* place, uint x, uint y) {
    return place->offset + (size_t)y * place->stride + x;
}

INLINE floatV vector_from(uint x) {
    return (floatV)((float)x) + LANE_INDEX(float) + 0.5f;
}

// The bits that are set in any lane.
INLINE int bits_of_any(intV bits) {
#if V == 1
    return bits;
#else
#if V == 16
    const int8 half_of = bits.lo | bits.hi;
    const int4 quarter = half_of.lo | half_of.hi;
#elif V == 8
    const int4 quarter = bits.lo | bits.hi;
#else
    const int4 quarter = bits;
#endif
    const int2 pair = quarter.lo | quarter.hi;
    return pair.x | pair.y;
#endif
}

// Is the condition true in any lane? The builtin would test each in turn.
INLINE bool any_of(intV condition) {
    return bits_of_any(condition) != 0;
}

// OP, min or max, of all lanes of `a`, as TYPE.
#if V == 1
#define FOLD_LANES(TYPE, OP, a) return a
#else
#if V == 16
#define QUARTER_OF(OP, a) OP(OP((a).lo.lo, (a).hi.lo), OP((a).lo.hi, (a).hi.hi))
#elif V == 8
#define QUARTER_OF(OP, a) OP((a).lo, (a).hi)
#else
#define QUARTER_OF(OP, a) (a)
#endif
#define FOLD_LANES(TYPE, OP, a)                                                                                        \
    const TYPE##4 quarter = QUARTER_OF(OP, a);                                                                   \
    const TYPE##2 two = OP(quarter.lo, quarter.hi);                                                                    \
    return OP(two.x, two.y)
#endif

INLINE int greatest(intV a) {
    FOLD_LANES(int, max, a);
}

// The least of all lanes, none of which is NaN.
INLINE float least_of(floatV a) {
    FOLD_LANES(float, min, a);
}

// Sum of two floats and its rounding error, exactly (Knuth 1969).
typedef struct {
    floatV high, low;
} pairV;

INLINE pairV two_sum(floatV a, floatV b) {
    const floatV sum = a + b;
    const floatV b_part = sum - a;
    return (pairV){sum, (a - (sum - b_part)) + (b - b_part)};
}

INLINE pairV two_product(floatV a, floatV b) {
    const floatV product = a * b;
    return (pairV){product, fma(a, b, -product)};
}

INLINE pairV renormalised(floatV high, floatV low) {
    const floatV sum = high + low;
    return (pairV){sum, low - (sum - high)};
}

// numerator / (high + low), to little more than half an ulp: the float quotient, corrected by what is left of the
// numerator. A zero denominator gives infinity, as the pole of a projection should, and so does a quotient beyond the
// floats.
INLINE floatV quotient_pair(pairV numerator, pairV denominator) {
    const floatV inverse = 1.0f / denominator.high;
    const floatV guess = numerator.high * inverse;
    floatV rest = fma(-guess, denominator.high, numerator.high);
    rest = fma(-guess, denominator.low, rest) + numerator.low;
    const floatV refined = fma(rest, inverse, guess);
    return select(refined, guess, guess == INFINITY);
}

// 1 / sqrt(square) to 4.7e-6: halved exponent, two steps of Newton. Square root and division would keep the divider busy
// for longer than all the rest.
INLINE floatV inverse_root_guess(floatV square) {
    floatV guess = as_floatV(0x5f375a86 - (as_intV(square) >> 1));
    const floatV half_square = 0.5f * square;
    guess *= fma(-half_square * guess, guess, (floatV)1.5f);
    return guess * fma(-half_square * guess, guess, (floatV)1.5f);
}

#if FP64

typedef LANES(double) wideV;
typedef LANES(long) longV;
#define convert_wideV JOIN(convert_, LANES(double))
#define as_wideV JOIN(as_, LANES(double))
#define as_longV JOIN(as_, LANES(long))

INLINE wideV wide_constant(wide bits) {
    return (wideV)as_double(bits);
}
INLINE wideV wide_from(floatV value) {
    return convert_wideV(value);
}
INLINE floatV wide_to_float(wideV value) {
    return convert_floatV(value);
}
INLINE wideV wide_negative(wideV a) {
    return -a;
}
INLINE wideV wide_add(wideV a, wideV b) {
    return a + b;
}
INLINE wideV wide_multiply(wideV a, floatV b) {
    return a * convert_wideV(b);
}
INLINE wideV wide_multiply_add(wideV a, floatV b, wideV c) {
    return fma(a, convert_wideV(b), c);
}
INLINE wideV wide_product(wideV a, wideV b) {
    return a * b;
}

// c[0] y + c[1]
INLINE wideV wide_at_row(const wide* c, uint y) {
    return (wideV)fma(as_double(c[0]), (double)y + 0.5, as_double(c[1]));
}

// c[0] x + c[1] y + c[2]
INLINE wideV wide_at_pixel(const wide* c, uint x, uint y) {
    const wideV column = (wideV)((double)x + 0.5) + LANE_INDEX(double);
    return fma((wideV)as_double(c[0]), column, wide_at_row(c + 1, y));
}

INLINE floatV wide_reciprocal(wideV s) {
    const floatV single = convert_floatV(s);
    const floatV guess = 1.0f / single;
    const floatV rest = convert_floatV(fma(-s, convert_wideV(guess), (wideV)1.0));
    return select(fma(guess, rest, guess), guess, guess == INFINITY);
}

INLINE floatV wide_quotient(wideV numerator, wideV denominator) {
    return convert_floatV(numerator / denominator);
}
INLINE wideV wide_ratio(wideV a, wideV b) {
    return a / b;
}

// value / sqrt(square): a step of Newton in double on the guess leaves 3.3e-11.
INLINE wideV wide_over_root(wideV value, wideV square) {
    const wideV guess = convert_wideV(inverse_root_guess(convert_floatV(square)));
    const wideV rest = fma(-square * guess, guess, (wideV)1.0);
    const wideV scaled = value * guess;
    return fma(scaled * 0.5, rest, scaled);
}

// amplitude (2^y - 1) + offset. 2^r - 1 = r q(r) on |r| <= 1/2 with an error of 2.4e-10 relative (Chebyshev
// fit), so that small exponents keep their accuracy.
INLINE floatV wide_exponential(wideV y, wide amplitude, wide offset) {
    const wideV shifted = y + 0x1.8p52; // the nearest integer ends up in the low bits
    const wideV r = y - (shifted - 0x1.8p52);
    wideV q = (wideV)0x1.00a581594758ep-16;
    q = fma(q, r, (wideV)0x1.443fffc90db59p-13);
    q = fma(q, r, (wideV)0x1.5d879ead06a82p-10);
    q = fma(q, r, (wideV)0x1.3b2a1b7152befp-7);
    q = fma(q, r, (wideV)0x1.c6b08d883dca1p-5);
    q = fma(q, r, (wideV)0x1.ebfbe045f4d3cp-3);
    q = fma(q, r, (wideV)0x1.62e42fefa39efp-1);
    const wideV power = as_wideV((as_longV(shifted) << 52) + 0x3ff0000000000000L);
    const wideV less_one = fma(power * r, q, power - 1.0);
    return convert_floatV(fma((wideV)as_double(amplitude), less_one, (wideV)as_double(offset)));
}

#else // sums of two floats

typedef pairV wideV;

INLINE wideV wide_constant(wide bits) {
    return (wideV){(floatV)as_float((uint)bits), (floatV)as_float((uint)(bits >> 32))};
}
INLINE wideV wide_from(floatV value) {
    return (wideV){value, (floatV)0.0f};
}
INLINE floatV wide_to_float(wideV value) {
    return value.high + value.low;
}

INLINE wideV wide_negative(wideV a) {
    return (wideV){-a.high, -a.low};
}

INLINE wideV wide_add(wideV a, wideV b) {
    const pairV sum = two_sum(a.high, b.high);
    return renormalised(sum.high, sum.low + (a.low + b.low));
}

INLINE wideV wide_multiply(wideV a, floatV b) {
    const pairV product = two_product(a.high, b);
    return renormalised(product.high, fma(a.low, b, product.low));
}

INLINE wideV wide_multiply_add(wideV a, floatV b, wideV c) {
    const pairV product = two_product(a.high, b);
    const pairV sum = two_sum(c.high, product.high);
    return renormalised(sum.high, sum.low + (fma(a.low, b, product.low) + c.low));
}

INLINE wideV wide_product(wideV a, wideV b) {
    const pairV product = two_product(a.high, b.high);
    return renormalised(product.high, fma(a.high, b.low, fma(a.low, b.high, product.low)));
}

INLINE wideV wide_at_row(const wide* c, uint y) {
    return wide_multiply_add(wide_constant(c[0]), (floatV)((float)y + 0.5f), wide_constant(c[1]));
}

INLINE wideV wide_at_pixel(const wide* c, uint x, uint y) {
    return wide_multiply_add(wide_constant(c[0]), vector_from(x), wide_at_row(c + 1, y));
}

INLINE floatV wide_quotient(wideV numerator, wideV denominator) {
    return quotient_pair(numerator, denominator);
}
INLINE floatV wide_reciprocal(wideV s) {
    return quotient_pair(wide_from((floatV)1.0f), s);
}

// a / b, to twice a float's precision.
INLINE wideV wide_ratio(wideV a, wideV b) {
    const floatV inverse = 1.0f / b.high;
    const floatV guess = a.high * inverse;
    floatV rest = fma(-guess, b.high, a.high);
    rest = fma(-guess, b.low, rest) + a.low;
    return renormalised(guess, rest * inverse);
}

INLINE wideV wide_over_root(wideV value, wideV square) {
    const floatV guess = inverse_root_guess(square.high);
    const pairV guess_square = two_product(guess, guess);
    floatV rest = fma(-square.high, guess_square.high, (floatV)1.0f);
    rest = fma(-square.high, guess_square.low, fma(-square.low, guess_square.high, rest));
    const pairV scaled = two_product(value.high, guess);
    return renormalised(scaled.high, fma(scaled.high * 0.5f, rest, fma(value.low, guess, scaled.low)));
}

// The same as in double: 2^r - 1 = r ln 2 + r^2 g(r), the first term kept to twice the precision.
INLINE floatV wide_exponential(wideV y, wide amplitude, wide offset) {
    const floatV shifted = y.high + 0x1.8p23f;
    const pairV r = two_sum(y.high - (shifted - 0x1.8p23f), y.low);
    floatV g = (floatV)0x1.008a2p-16f;
    g = fma(g, r.high, (floatV)0x1.44138ap-13f);
    g = fma(g, r.high, (floatV)0x1.5d87cp-10f);
    g = fma(g, r.high, (floatV)0x1.3b2a54p-7f);
    g = fma(g, r.high, (floatV)0x1.c6b08ep-5f);
    g = fma(g, r.high, (floatV)0x1.ebfbep-3f);
    const pairV linear = two_product(r.high, (floatV)0x1.62e43p-1f);
    floatV rest = fma(r.high, (floatV)-0x1.05c61p-29f, fma(r.low, (floatV)0x1.62e43p-1f, linear.low));
    rest = fma(r.high * r.high, g, rest);
    const floatV power = as_floatV((as_intV(shifted) << 23) + 0x3f800000);
    const pairV sum = two_sum(power - 1.0f, power * linear.high);
    const wideV less_one = renormalised(sum.high, fma(power, rest, sum.low));
    const wideV a = wide_constant(amplitude);
    pairV product = two_product(a.high, less_one.high);
    product.low += fma(a.high, less_one.low, a.low * less_one.high);
    return wide_to_float(wide_add(wide_constant(offset), product));
}

#endif

INLINE wideV wide_of_pair(pairV a) {
    return wide_add(wide_from(a.high), wide_from(a.low));
}

#endif
