// Discs on the pixels: which pixels a circle of confusion reaches, and its weights.

#ifndef FATHOM_NEAR_H
#define FATHOM_NEAR_H

#include "vector.h"

// Does a disc of that diameter reach so many half pixels aside and down? All kernels use this one expression.
INLINE intV reaches(floatV diameter, floatV twice_aside, floatV twice_down) {
    return fma(twice_aside, twice_aside, twice_down * twice_down) <= diameter * diameter;
}

// 1 + a of dof_masks.cl, so that a is a multiple of 2^-23.
INLINE floatV one_and_blurred(floatV c, float sharp, float inverse_transition) {
    const floatV blurred = (fabs(c) - sharp) * inverse_transition;
    return 1.0f + min(max(blurred, (floatV)0.0f), (floatV)1.0f);
}

INLINE floatV near_weight(floatV c, const near_field_params* p) {
    return select((floatV)0.0f, one_and_blurred(c, p->sharp, p->inverse_transition) - 1.0f, c < 0.0f);
}

#endif
