// Vectors of three or four components, interleaved in memory: x0 y0 z0 x1 y1 z1 ...
// Built for: CHANNELS = 3 4

#ifndef FATHOM_STORE_H
#define FATHOM_STORE_H

#include "vector.h"

#if !defined(CHANNELS) || CHANNELS < 3 || CHANNELS > 4
#error "CHANNELS is not defined: 3 or 4 floats a vector"
#endif

#if CHANNELS == 3
#define XYZ(i) x.s##i, y.s##i, z.s##i
#else
#define XYZW(i) x.s##i, y.s##i, z.s##i, w.s##i
#endif

// The compilers of CPU devices, which alone take V > 1, are all clang.
#define SHUFFLE __builtin_shufflevector

// Stores the vectors of neighbouring lanes one after another. `w` is written where there are four channels.
INLINE void store_vectors(floatV x, floatV y, floatV z, floatV w, __global float* target) {
#if V == 1
    target[0] = x;
    target[1] = y;
    target[2] = z;
#if CHANNELS == 4
    target[3] = w;
#endif
#elif CHANNELS == 3 && V == 4
    store_float((floatV)(XYZ(0), x.s1), target);
    store_float((floatV)(y.s1, z.s1, x.s2, y.s2), target + 4);
    store_float((floatV)(z.s2, XYZ(3)), target + 8);
#elif CHANNELS == 3 && V == 8
    store_float((floatV)(XYZ(0), XYZ(1), x.s2, y.s2), target);
    store_float((floatV)(z.s2, XYZ(3), XYZ(4), x.s5), target + 8);
    store_float((floatV)(y.s5, z.s5, XYZ(6), XYZ(7)), target + 16);
#elif CHANNELS == 3
    // Two permutations a store: written as literals, clang makes eight of each.
    const floatV xy0 = SHUFFLE(x, y, 0, 16, -1, 1, 17, -1, 2, 18, -1, 3, 19, -1, 4, 20, -1, 5);
    const floatV xy1 = SHUFFLE(x, y, 21, -1, 6, 22, -1, 7, 23, -1, 8, 24, -1, 9, 25, -1, 10, 26);
    const floatV xy2 = SHUFFLE(x, y, -1, 11, 27, -1, 12, 28, -1, 13, 29, -1, 14, 30, -1, 15, 31, -1);
    store_float(SHUFFLE(xy0, z, 0, 1, 16, 3, 4, 17, 6, 7, 18, 9, 10, 19, 12, 13, 20, 15), target);
    store_float(SHUFFLE(xy1, z, 0, 21, 2, 3, 22, 5, 6, 23, 8, 9, 24, 11, 12, 25, 14, 15), target + 16);
    store_float(SHUFFLE(xy2, z, 26, 1, 2, 27, 4, 5, 28, 7, 8, 29, 10, 11, 30, 13, 14, 31), target + 32);
#elif V == 4
    store_float((floatV)(XYZW(0)), target);
    store_float((floatV)(XYZW(1)), target + 4);
    store_float((floatV)(XYZW(2)), target + 8);
    store_float((floatV)(XYZW(3)), target + 12);
#elif V == 8
    store_float((floatV)(XYZW(0), XYZW(1)), target);
    store_float((floatV)(XYZW(2), XYZW(3)), target + 8);
    store_float((floatV)(XYZW(4), XYZW(5)), target + 16);
    store_float((floatV)(XYZW(6), XYZW(7)), target + 24);
#else
    store_float((floatV)(XYZW(0), XYZW(1), XYZW(2), XYZW(3)), target);
    store_float((floatV)(XYZW(4), XYZW(5), XYZW(6), XYZW(7)), target + 16);
    store_float((floatV)(XYZW(8), XYZW(9), XYZW(a), XYZW(b)), target + 32);
    store_float((floatV)(XYZW(c), XYZW(d), XYZW(e), XYZW(f)), target + 48);
#endif
}

#endif
