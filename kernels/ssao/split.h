// An image split into 4 x 4 planes, see split_params. Loads are contiguous when all lanes look in the same direction.

#ifndef FATHOM_SPLIT_H
#define FATHOM_SPLIT_H

#include "vector.h"

// Inverse depth where there is no surface: behind everything, and still a number.
#define NOTHING -1e37f // background
#define UNKNOWN -2e37f // invalid, or outside the image

INLINE uint in_plane(const split_params* s, int plane, int column, int row) {
    return (uint)plane * s->plane + (uint)(row + 1) * s->stride + (uint)(column + split_margin);
}

// The same among the sums.
INLINE uint in_sums(const split_params* s, const band_params* band, int plane, int column, int row) {
    return (uint)plane * s->plane + ((uint)(row + 1) & band->ring) * s->stride + (uint)(column + split_margin);
}

// Slopes to the right and down in one word, the leading 16 bits of each.
INLINE floatV packed_slopes(floatV right, floatV down) {
    const intV a = as_intV(right), b = as_intV(down);
    const intV low = ((a + 0x7fff + ((a >> 16) & 1)) >> 16) & 0xffff;
    return as_floatV(((b + 0x7fff + ((b >> 16) & 1)) & (int)0xffff0000) | low);
}
INLINE floatV slope_right(floatV packed) {
    return as_floatV(as_intV(packed) << 16);
}
INLINE floatV slope_down(floatV packed) {
    return as_floatV(as_intV(packed) & (int)0xffff0000);
}

// 4 V neighbours of a row to V of each plane and back.
#if V == 1
#define DEAL(v, p)                                                                                                     \
    p[0] = v[0], p[1] = v[1], p[2] = v[2], p[3] = v[3]
#define RIFFLE(p, v) DEAL(p, v)
#else
#define DEAL(v, p)                                                                                                     \
    p[0] = (floatV)(v[0].even.even, v[1].even.even, v[2].even.even, v[3].even.even),                                   \
    p[1] = (floatV)(v[0].odd.even, v[1].odd.even, v[2].odd.even, v[3].odd.even),                                       \
    p[2] = (floatV)(v[0].even.odd, v[1].even.odd, v[2].even.odd, v[3].even.odd),                                       \
    p[3] = (floatV)(v[0].odd.odd, v[1].odd.odd, v[2].odd.odd, v[3].odd.odd)
#define RIFFLE(p, v)                                                                                                   \
    {                                                                                                                  \
        floatV a, b, c, d;                                                                                             \
        a.even = p[0].lo, a.odd = p[2].lo, b.even = p[0].hi, b.odd = p[2].hi;                                          \
        c.even = p[1].lo, c.odd = p[3].lo, d.even = p[1].hi, d.odd = p[3].hi;                                          \
        v[0].even = a.lo, v[0].odd = c.lo, v[1].even = a.hi, v[1].odd = c.hi;                                          \
        v[2].even = b.lo, v[2].odd = d.lo, v[3].even = b.hi, v[3].odd = d.hi;                                          \
    }
#endif

#endif
