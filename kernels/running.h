// Running sums of 16 pixels.

#ifndef FATHOM_RUNNING_H
#define FATHOM_RUNNING_H

#include "vector.h"

// Sums over the lanes before each one, and over all of them, always in the same order.
#ifdef __has_builtin
#if __has_builtin(__builtin_shufflevector)
#define LATER(v, ...) __builtin_shufflevector(v, (float16)0.0f, __VA_ARGS__)
#define LATER_1(v) LATER(v, 16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14)
#define LATER_2(v) LATER(v, 16, 16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13)
#define LATER_4(v) LATER(v, 16, 16, 16, 16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)
#define LATER_8(v) LATER(v, 16, 16, 16, 16, 16, 16, 16, 16, 0, 1, 2, 3, 4, 5, 6, 7)
#endif
#endif
#ifndef LATER_1
#define LATER_1(v) (float16)(0.0f, v.s0123, v.s4567, v.s89ab, v.sc, v.sd, v.se)
#define LATER_2(v) (float16)((float2)0.0f, v.s01234567, v.s89ab, v.scd)
#define LATER_4(v) (float16)((float4)0.0f, v.s01234567, v.s89ab)
#define LATER_8(v) (float16)((float8)0.0f, v.s01234567)
#endif

// The running sums up to each pixel of `value`, continued from `sum`.
INLINE float16 running(float16 value, float* sum) {
    float16 before = LATER_1(value);
    before += LATER_1(before);
    before += LATER_2(before);
    before += LATER_4(before);
    before += LATER_8(before);
    const float16 sums = *sum + before;
    *sum += before.sf + value.sf;
    return sums;
}

#endif
