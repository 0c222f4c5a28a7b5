// Discs on the pixels: which pixels a circle of confusion reaches, and its near weight.

#ifndef FATHOM_NEAR_H
#define FATHOM_NEAR_H

#include "lanes.h"

// Does a disc of that diameter reach so many half pixels aside and down? One expression for all who ask.
INLINE intV reaches(floatV diameter, floatV twice_aside, floatV twice_down) {
    return fma(twice_aside, twice_aside, twice_down * twice_down) <= diameter * diameter;
}

// See dof_masks.cl.
INLINE floatV near_weight(floatV c, const near_params* p) {
    const floatV blurred = (-c - p->sharp) * p->inverse_transition, none = (floatV)0.0f;
    const floatV away = (1.0f + min(max(blurred, none), (floatV)1.0f)) - 1.0f;
    return select(none, away, c < 0.0f);
}

#endif
