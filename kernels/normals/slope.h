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

// Of such a distance: what neither side explains by more is a pixel of its own, where one neighbour is twice as close as the other.
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

// Of a difference from a pixel to the next: what the one beside it may be off, where a surface that bends goes on.
#define BENDS 0.5f
// Widths of a pixel that it rises at most from one to the next: where it bends, where a neighbour alone is part of it, and up to an edge.
#define STEEPEST 16.0f
#define STEEPEST_OF_TWO 5.0f
#define STEEPEST_EDGE 150.0f

// Does the surface of two neighbours go on to the pixel, `rise` away from the one next to it, which they mispredict by `off`? `other`:
// how far the neighbour on the other side lies.
INLINE intV goes_on(floatV off, floatV rise, floatV other, floatV least, floatV width) {
    return (off <= least) | ((off < BENDS * fabs(rise)) & (fabs(rise) < STEEPEST * width) & (fabs(rise) <= fabs(other)));
}

// The slope, except on objects one or two pixels wide, whose neighbours are other objects: planes of those must not be theirs. `step`:
// what other objects lie off by. `width`: of a pixel, as inverse depth.
// What is nearer than both neighbours, as a strand, faces the camera. What is deeper than one and nearer than the other, as the top of
// a box or the ground behind a ridge, rises with the gentler of the two, if the nearer one's surface does not fall back behind it; else
// to the nearer one, within two radii. Anything goes on to a neighbour to which it rises gently.
// At the end of a surface, before the sky, nothing tells whether the one neighbour is another object: only the slope has a limit then.
INLINE floatV unless_thin(floatV found, const floatV* nearby, floatV q, floatV step, floatV tolerance, floatV width) {
    const floatV before = q - nearby[1], after = nearby[2] - q;
    const floatV off_before = misprediction(nearby[0], nearby[1], q), off_after = misprediction(nearby[3], nearby[2], q);
    const floatV narrow = fma((floatV)NARROW, step - tolerance, tolerance); // noise explains nothing
    const intV whole = isfinite(before - after);
    const intV explained = min(off_before, off_after) <= narrow;
    if (!any_of(!explained))
        return found;
    const floatV before_that = nearby[1] - nearby[0], after_that = nearby[3] - nearby[2];
    const intV by_before = fabs(before) <= fabs(after), up = after > 0.0f;
    const floatV even = select((floatV)0.0f, before, before == after), one = select(after, before, by_before);
    const floatV closer = select(one, even, fabs(before) == fabs(after));
    const floatV nearer = select(before, after, up), beyond_nearer = select(before_that, after_that, up);
    const intV clearly = fabs(closer) < 0.5f * max(fabs(before), fabs(after));
    const floatV least = select(step, narrow, clearly);
    const intV fits = goes_on(off_before, before, after, least, width) | goes_on(off_after, after, before, least, width);
    const intV between = (min(before, after) > 0.0f) | (max(before, after) < 0.0f);
    const intV goes_up = !(select(-beyond_nearer, beyond_nearer, up) <= -BENDS * fabs(nearer)); // also where it is missing
    const intV edge = between & goes_up & (fabs(closer) < fma((floatV)STEEPEST_EDGE, width, tolerance));
    const intV two = fabs(closer) < min(fma((floatV)STEEPEST_OF_TWO, width, tolerance), step);
    const floatV top = select((floatV)0.0f, nearer, between & (fabs(closer) >= step) & (fabs(nearer) < step * (2.0f / THIN)));
    const floatV steepest = fma((floatV)STEEPEST, width, tolerance);
    const intV alone = !(fabs(before_that) < INFINITY) & !(fabs(after_that) < INFINITY); // nothing beyond the one neighbour
    const floatV limited = select(max(min(found, steepest), -steepest), found, explained | alone);
    return select(select(limited, select(top, closer, edge | two), whole), found, fits & whole);
}

#endif
