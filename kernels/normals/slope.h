// Slope of inverse depth along one axis of the screen, from two neighbours on either side.
//   b = |2 before1 - before2 - centre|,  a = |2 after1 - after2 - centre|       how well either side predicts the centre
// Inverse depth is affine on a plane, so the side that predicts better lies on the centre's surface: two-tap extrapolation
// (atyuwen 2020, "Accurate Normal Reconstruction from Depth Buffer"), which holds at edges, creases and borders alike.
// Where both predict about as well, as on a curved surface, their mean is exact to the second order; where both are within
// the stored values' rounding, the least-squares slope of all five has the least noise.
// Built for: PERSPECTIVE = 0 1

#ifndef FATHOM_SLOPE_H
#define FATHOM_SLOPE_H

#include "vector.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in the camera centre, 0 where they are parallel (orthographic)"
#endif

// Both sides count when the worse one is off by no more than this many times the better one. From 2 to 8 the mean error
// on a rendered frame changes by 2%.
#define WORSE_SIDE 4.0f

// Of the radius: what lies that far from its neighbours' planes is not part of them.
#define THIN 0.25f

// Of such a distance: what neither side explains by more belongs to a neighbour twice as close as the other.
#define NARROW 0.25f

// Inverse depth of a neighbour; NaN for the background, because no slope may lead to it.
INLINE floatV surface_only(floatV q) {
#if PERSPECTIVE
    return select(q, (floatV)NAN, q == 0.0f);
#else
    return q;
#endif
}

// How far a prediction from two pixels is off the centre, or without the one beyond that of the other. Infinite without both.
INLINE floatV best_misprediction(floatV two_taps, floatV one_tap) {
    const floatV error = select(one_tap, two_taps, two_taps < INFINITY);
    return select((floatV)INFINITY, error, error < INFINITY);
}

// That of a prediction from `nearby` and the pixel `beyond` it.
INLINE floatV misprediction(floatV beyond, floatV nearby, floatV centre) {
    const floatV two_taps = fabs(fma((floatV)2.0f, nearby, -beyond) - centre), one_tap = fabs(nearby - centre);
    return best_misprediction(two_taps, one_tap);
}

// The slope, where the sides mispredict the centre by `before` and `after`, from those of one side, of both and of all five pixels.
INLINE floatV slope_by(floatV before, floatV after, floatV one_before, floatV one_after, floatV both_sides,
                       floatV all_five, floatV tolerance) {
    const floatV better = min(before, after), worse = max(before, after);
    const floatV one_side = select(one_after, one_before, before < after);
    const intV both = (worse <= fma((floatV)WORSE_SIDE, better, tolerance)) & (worse < INFINITY);
    const intV all = (worse <= tolerance) & (fabs(all_five) < INFINITY);
    const floatV chosen = select(select(one_side, both_sides, both), all_five, all);
    return select((floatV)0.0f, chosen, better < INFINITY);
}

// dq/dx in inverse depth per pixel, or dq/dy. Neighbours that are NaN or infinite are never chosen; 0 where there are none.
// `tolerance` is four times the bound of a stored value's error in q: what rounding alone can make of a prediction.
INLINE floatV slope(floatV before2, floatV before1, floatV centre, floatV after1, floatV after2, floatV tolerance) {
    return slope_by(misprediction(before2, before1, centre), misprediction(after2, after1, centre), centre - before1,
                    after1 - centre, 0.5f * (after1 - before1),
                    0.1f * fma((floatV)2.0f, after2 - before2, after1 - before1), tolerance);
}

// The slope, except on objects one or two pixels wide. Two taps do not fit their plane, and planes of other objects must not
// be theirs. Such a pixel takes the difference to its closer neighbour if that is within `step`. If it lies deeper than one
// neighbour and nearer than the other, as the top of a box does, its plane rises to the nearer one, unless that is two radii away.
// Any other faces the camera.
INLINE floatV unless_thin(floatV found, const floatV* nearby, floatV q, floatV step, floatV tolerance) {
    const floatV from_before = fabs(fma((floatV)2.0f, nearby[1], -nearby[0]) - q);
    const floatV from_after = fabs(fma((floatV)2.0f, nearby[2], -nearby[3]) - q);
    const floatV narrow = fma((floatV)NARROW, step - tolerance, tolerance); // noise explains nothing
    if (!any_of((from_before > narrow) & (from_after > narrow)))
        return found;
    const floatV before = q - nearby[1], after = nearby[2] - q;
    const floatV closer = select(after, before, !(fabs(before) > fabs(after)));
    const floatV nearer = select(before, after, after > 0.0f);
    const intV between = (min(before, after) > 0.0f) | (max(before, after) < 0.0f);
    const floatV top = select((floatV)0.0f, nearer, between & (fabs(nearer) < step * (2.0f / THIN)));
    const intV near = fabs(closer) < step;
    const intV clearly = near & (fabs(closer) < 0.5f * max(fabs(before), fabs(after)));
    const floatV least = select(step, narrow, clearly);
    return select(found, select(top, closer, near), (from_before > least) & (from_after > least));
}

#endif
