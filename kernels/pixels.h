// Colours as they lie in memory: floats, halves, or integers that count from 0 to 1.
// Built for: ELEMENT = 0 1 2 3

#ifndef FATHOM_PIXELS_H
#define FATHOM_PIXELS_H

#include "params.h"

#if !defined(ELEMENT) || ELEMENT < ELEMENT_FLOAT || ELEMENT > ELEMENT_U8
#error "ELEMENT is not defined: one of the ELEMENT_ constants of params.h"
#endif

#if ELEMENT == ELEMENT_FLOAT
#define ELEMENT_TYPE float
#elif ELEMENT == ELEMENT_U8
#define ELEMENT_TYPE uchar
#else
#define ELEMENT_TYPE ushort
#endif

static inline float read_element(__global const ELEMENT_TYPE* source, size_t at) {
#if ELEMENT == ELEMENT_FLOAT
    return source[at];
#elif ELEMENT == ELEMENT_HALF
    return vload_half(at, (__global const half*)source);
#elif ELEMENT == ELEMENT_U16
    return (float)source[at] / 65535.0f;
#else
    return (float)source[at] / 255.0f;
#endif
}

// floor(value most + 1/2), exactly: what fma() gives may be rounded up to the next integer, which the remainder tells.
// TYPE is float or a vector of it; the value is 0 to 1.
#define CORRECTED(TYPE, value, most, code) ((code) + floor(fma(value, (TYPE)(most), (TYPE)(0.5f) - (code))))
#define CODE_OF(TYPE, value, most) CORRECTED(TYPE, value, most, floor(fma(value, (TYPE)(most), (TYPE)(0.5f))))

// Integers are rounded to the nearest and end at 0 and 1.
static inline void write_element(float value, __global ELEMENT_TYPE* target, size_t at) {
#if ELEMENT == ELEMENT_FLOAT
    target[at] = value;
#elif ELEMENT == ELEMENT_HALF
    vstore_half_rte(value, at, (__global half*)target);
#elif ELEMENT == ELEMENT_U16
    target[at] = (ushort)CODE_OF(float, min(max(value, 0.0f), 1.0f), 65535.0f);
#else
    target[at] = (uchar)CODE_OF(float, min(max(value, 0.0f), 1.0f), 255.0f);
#endif
}

#endif
