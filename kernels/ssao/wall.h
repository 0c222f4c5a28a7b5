// Slopes of a pixel through which a crease passes: those of one of its walls. Slopes between both would be too open.

#ifndef FATHOM_WALL_H
#define FATHOM_WALL_H

#include "normals/slope.h"

#define FOLDED 4.0f // times what a side mispredicts that a fold is at least
#define EVEN 1e-3f // relative difference of two squares of slopes that are taken for the same

// Do both sides fit the pixel, and neither the other? Then a crease passes through it, where a surface that bends would be
// mispredicted by as much as it bends.
INLINE intV has_crease(const floatV* nearby, floatV q, floatV tolerance) {
    const floatV before = misprediction(nearby[0], nearby[1], q), after = misprediction(nearby[3], nearby[2], q);
    const floatV fold = nearby[1] + nearby[2] - 2.0f * q, worse = max(before, after);
    return (worse <= fma((floatV)WORSE_SIDE, min(before, after), tolerance)) &
           (fold > fma((floatV)FOLDED, worse, 2.0f * tolerance));
}

// What the closest corner lies off a plane through the pixel: another object may cover the others.
INLINE floatV off_corners(const floatV* corners, floatV q, floatV right, floatV down) {
    return fmin(fmin(fabs(corners[0] - q + (right + down)), fabs(corners[3] - q - (right + down))),
                fmin(fabs(corners[1] - q - (right - down)), fabs(corners[2] - q + (right - down))));
}

// The plane of the wall that a corner lies on. If both walls have one it is the flatter wall's, or the left one's if they are equally
// steep. `corners`: above left and right, below left and right.
INLINE void take_wall(const floatV* across, const floatV* along, const floatV* corners, floatV q, floatV tolerance,
                      intV folded_across, intV folded_along, floatV* right, floatV* down) {
    const floatV left = q - across[1], above = q - along[1];
    const floatV to_right = select(*right, across[2] - q, folded_across), below = select(*down, along[2] - q, folded_along);
    const floatV to_left = select(*right, left, folded_across), to_above = select(*down, above, folded_along);
    // What the corners lie off the planes of either pairing, the closer of two.
    const floatV together = fmin(fabs(corners[3] - q - (to_right + below)), fabs(corners[0] - q + (to_left + to_above)));
    const floatV apart = fmin(fabs(corners[1] - q - (to_right - to_above)), fabs(corners[2] - q + (to_left - below)));
    const intV same = (together < apart) | !(folded_across & folded_along);
    const floatV of_right = select(to_above, below, same), of_left = select(below, to_above, same);
    const floatV off_right = off_corners(corners, q, to_right, of_right), off_left = off_corners(corners, q, to_left, of_left);
    const floatV steep_right = fma(to_right, to_right, of_right * of_right);
    const floatV steep_left = fma(to_left, to_left, of_left * of_left);
    const intV flatter = steep_left - steep_right > EVEN * (steep_right + steep_left);
    const intV takes_right = fma((floatV)WORSE_SIDE, off_right, tolerance) < off_left;
    const intV takes_left = fma((floatV)WORSE_SIDE, off_left, tolerance) < off_right;
    const intV takes = takes_right | (flatter & !takes_left);
    *right = select(to_left, to_right, takes);
    *down = select(of_left, of_right, takes);
}

#endif
