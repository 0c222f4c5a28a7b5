// Slopes of a pixel through which a crease passes: those of one of its walls. Slopes between both would be too open.

#ifndef FATHOM_WALL_H
#define FATHOM_WALL_H

#include "normals/slope.h"

#define EVEN 1e-3f // relative difference of two squares of slopes that are taken for the same

// Do both sides fit the pixel, and neither the other? Then a crease passes through it.
INLINE intV has_crease(const floatV* nearby, floatV q, floatV tolerance) {
    const floatV before = misprediction(nearby[0], nearby[1], q), after = misprediction(nearby[3], nearby[2], q);
    return (max(before, after) <= tolerance) & (nearby[1] + nearby[2] - 2.0f * q > 2.0f * tolerance);
}

// The plane of the flatter wall, or of the left one if they are equally steep. `corners`: above left and right, below left and right.
INLINE void take_wall(const floatV* across, const floatV* along, const floatV* corners, floatV q, intV folded_across,
                      intV folded_along, floatV* right, floatV* down) {
    const floatV left = q - across[1], above = q - along[1];
    const floatV to_right = select(*right, across[2] - q, folded_across), below = select(*down, along[2] - q, folded_along);
    const floatV to_left = select(*right, left, folded_across), to_above = select(*down, above, folded_along);
    // What the corners lie off the planes of either pairing, the closer of two: another object may cover one.
    const floatV together = fmin(fabs(corners[3] - q - (to_right + below)), fabs(corners[0] - q + (to_left + to_above)));
    const floatV apart = fmin(fabs(corners[1] - q - (to_right - to_above)), fabs(corners[2] - q + (to_left - below)));
    const intV same = (together < apart) | !(folded_across & folded_along);
    const floatV of_right = select(to_above, below, same), of_left = select(below, to_above, same);
    const floatV steep_right = fma(to_right, to_right, of_right * of_right);
    const floatV steep_left = fma(to_left, to_left, of_left * of_left);
    const intV flatter = steep_left - steep_right > EVEN * (steep_right + steep_left);
    *right = select(to_left, to_right, flatter);
    *down = select(of_left, of_right, flatter);
}

#endif
