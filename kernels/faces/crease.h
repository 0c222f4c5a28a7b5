// A crease between a pixel of a lens's image and a neighbour of it, as the inverse distance of the pixel says it: negative, with the
// neighbour and the way in which the walls meet in the last three bits.

#ifndef FATHOM_CREASE_H
#define FATHOM_CREASE_H

#include "vector.h"

#define CREASE_RIGHT 0
#define CREASE_LEFT 1
#define CREASE_BELOW 2
#define CREASE_ABOVE 3
#define CREASE_IS_HOLLOW 4 // the nearer of both planes is seen there, otherwise the farther one
#define CREASE_BITS 7

INLINE floatV with_crease(floatV q, intV crease) {
    return -as_floatV((as_intV(q) & ~CREASE_BITS) | crease);
}

// Pixels from one to the neighbour behind its crease, in an image of so many pixels from row to row.
INLINE intV step_over_crease(floatV q, int stride) {
    const intV where = as_intV(q) & 3;
    const intV sideways = select((intV)1, (intV)-1, where == CREASE_LEFT);
    return select(sideways, select((intV)stride, (intV)-stride, where == CREASE_ABOVE), where >= CREASE_BELOW);
}

INLINE intV is_hollow(floatV q) {
    return (as_intV(q) & CREASE_IS_HOLLOW) != 0;
}

#endif
