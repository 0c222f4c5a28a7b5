// What a column shows: the part of a side of a slice that one sample blocks.
// A column goes along its own ray, from the surface that the sample sees to `back`, and ends at the sphere of the radius. In
// inverse depth the cotangent of the angle t from the view ray is affine in (q - q_c) / s, s pixels away: no square root but
// that of the sphere, no angle, and the tangent plane is exact under every camera. Therrien et al. 2023, algorithm 1, lines 14
// to 17, takes a sample for one point with a thickness; here its surface goes on, to an edge or half way to the next sample.
// Built for: PERSPECTIVE = 0 1

#ifndef FATHOM_COLUMN_H
#define FATHOM_COLUMN_H

#include "ssao/split.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in the camera centre, 0 where they are parallel (orthographic)"
#endif

// 1 / sqrt(a) to 1.8e-3: one step of Newton.
INLINE floatV rough_inverse_root(floatV a) {
    const floatV guess = as_floatV(0x5f375a86 - (as_intV(a) >> 1));
    return guess * fma(-0.5f * a * guess, guess, (floatV)1.5f);
}

// 1 / sqrt(a) to 5e-6: two steps.
INLINE floatV inverse_root(floatV a) {
    const floatV rough = rough_inverse_root(a);
    return rough * fma(-0.5f * a * rough, rough, (floatV)1.5f);
}

// 1 / a to 2e-4: two steps of Newton.
INLINE floatV rough_inverse(floatV a) {
    const floatV guess = as_floatV(0x7ef311c7 - as_intV(a));
    const floatV better = guess * fma(-a, guess, (floatV)2.0f);
    return better * fma(-a, better, (floatV)2.0f);
}

// The pixels of a work-item, their rays, and what one pixel's step adds to these.
typedef struct {
    intV surface;
    floatV q, error;
    floatV right, down; // slopes of q
    floatV direction[3], length, inverse_length;
    floatV along[2]; // a step to the right and down, as far as it goes towards the camera
    floatV distance; // from the camera centre; 1 for an orthographic camera
    floatV steepest; // slope that a surface is followed along if it is not the tangent plane's
} pixelV;

// A slice: the direction (x, y) on the screen, the sphere's radius in it, and how its sectors are rounded.
typedef struct {
    float x, y, radius, rounding;
    floatV along, across_square, inverse_across; // a step's length towards the camera, and across the view ray
    floatV slope;
} sliceV;

// One side of a slice: cot t = scale (q - q_c) / s + offset.
typedef struct {
    float across_x, across_y, along_x, along_y; // a pixel's step across and along it
    floatV q;                                   // of the pixel, moved towards the camera by what its depth may be off
    floatV slack;                               // what depths may be off by
    floatV across, tangent;                     // slopes of the tangent plane across the slice and along it
    floatV scale, offset;                       // of the cotangent
    floatV middle, middle_step;                 // where the sphere's centre lies on the ray s pixels away, less q
    floatV reach, reach_step, cut; // its half length there is root((reach - s reach_step)^2 - s^2 cut) / per_depth
    floatV per_depth;
    floatV nearest;      // the sphere's near end is at least here: the camera centre may be inside
    floatV extent;       // pixels that the sphere covers on the screen
    floatV rises, falls; // steepest slopes that a tap's surface is followed along
    floatV first;        // (q - q_c) / s from which on the first sector may be blocked
    floatV nu, whole;    // and twice the measure of the side
    floatV lowest;       // cosine of the tangent plane
    floatV sectors_square, sectors_nu, sectors_offset;
} sideV;

typedef struct {
    floatV low, high; // q less q_c between which a column counts
} sphereV;

// The sphere of the radius as the columns of a side meet it.
INLINE void set_sphere(sideV* side, const pixelV* c, const sliceV* slice, float sign) {
    const floatV toward = sign * slice->along;
#if PERSPECTIVE
    const float square = slice->radius * slice->radius;
    const floatV beyond = fma(c->distance, c->distance, (floatV)-square), least = 1e-5f * square;
    const floatV outside = select(beyond, least, fabs(beyond) < least); // of the camera centre from the sphere
    side->per_depth = 1.0f / outside;
    side->nearest = select((floatV)-1e30f, (floatV)1e30f, outside < 0.0f);
    side->cut = outside * slice->across_square;
    side->middle = c->q * side->per_depth * square;
    side->middle_step = c->distance * side->per_depth * toward;
    side->reach = slice->radius * c->length;
    side->reach_step = slice->radius * toward;
#else
    side->per_depth = c->inverse_length;
    side->nearest = -1e30f;
    side->cut = slice->across_square;
    side->middle = 0.0f;
    side->middle_step = toward * c->inverse_length;
    side->reach = slice->radius;
    side->reach_step = 0.0f;
#endif
    // It ends on the screen where its half length does.
    const floatV cut = max(side->cut, 0.0f);
    const floatV falls = fma(cut, rough_inverse_root(cut), side->reach_step);
    const floatV far_away =
        select((floatV)1e9f, side->reach * rough_inverse(falls), (falls > 0.0f) & (side->cut > 0.0f));
    side->extent = min(far_away, 1e9f);
}

INLINE sphereV sphere_at(const sideV* side, __global const tap_params* tap) {
    const floatV reach = fma((floatV)-tap->distance, side->reach_step, side->reach);
    const floatV square = max(fma((floatV)-tap->square_distance, side->cut, reach * reach), 0.0f);
    const floatV half_length = square * rough_inverse_root(square);
    const floatV middle = fma((floatV)-tap->distance, side->middle_step, side->middle);
    return (sphereV){fma(-half_length, side->per_depth, middle),
                   max(fma(half_length, side->per_depth, middle), side->nearest)};
}

// What a tap sees: its surface where the slice passes it, less q_c, and how it goes on along the slice.
typedef struct {
    floatV front, to_line, tilt;
    floatV itself; // inverse depth of the tap's own pixel
} columnV;

INLINE columnV column_at(const sideV* side, __global const float* fronts, __global const float* slopes, uint at,
                         __global const tap_params* tap) {
    const floatV packed = LOAD(float, slopes + at), right = slope_right(packed), down = slope_down(packed);
    const floatV across = fma((floatV)side->across_x, right, side->across_y * down);
    columnV column;
    column.to_line = fma(across, (floatV)tap->aside, -side->q);
    column.tilt = fma((floatV)side->along_x, right, side->along_y * down);
    column.itself = LOAD(float, fronts + at);
    column.front = column.itself + column.to_line;
    return column;
}

// How high what a tap sees may rise, wherever between its neighbours it ends: (q - q_c) / s.
INLINE floatV peak_of(const columnV* column, __global const tap_params* tap) {
    const floatV low = fma(column->tilt, (floatV)tap->low, column->front) * tap->inverse_low;
    const floatV high = fma(column->tilt, (floatV)tap->high, column->front) * tap->inverse_high;
    return max(low, high);
}

// And does its own pixel lie above the tangent plane?
INLINE intV is_above(const sideV* side, const columnV* column, __global const tap_params* tap) {
    const floatV height = fma(side->across, (floatV)tap->aside, column->itself - side->q) - side->tangent * tap->distance;
    return height > -side->slack;
}

// The part of a tap's column that lies inside the sphere, (q - q_c) / s, and whether it may block a sector there.
typedef struct {
    floatV low, high;
    intV counts;
} boundsV;

INLINE boundsV bounds_at(const sideV* side, floatV first, const columnV* column, __global const tap_params* tap) {
    const sphereV sphere = sphere_at(side, tap);
    boundsV within = {sphere.low * tap->inverse_distance, sphere.high * tap->inverse_distance, 0};
    const floatV peak = min(peak_of(column, tap), within.high);
    within.counts = (peak > first) & (peak > within.low) & is_above(side, column, tap);
    return within;
}

// Two neighbouring samples meet in an outward edge if the surface of each, extended to the other sample, passes above it.
// The edge then ends both surfaces.
typedef struct {
    intV outward;
    floatV place; // (q - q_c) / s
} edgeV;

INLINE edgeV edge_of(const columnV* a, const columnV* b, __global const tap_params* tap_b) {
    const floatV gap = (floatV)tap_b->gap;
    const floatV over = fma(a->tilt, gap, a->front) - b->front, under = fma(-b->tilt, gap, b->front) - a->front;
    const floatV sum = over + under;
    return (edgeV){(over > 0.0f) & (under > 0.0f),
                   fma(a->tilt * gap, under, a->front * sum) *
                       rough_inverse(fma(gap, under, (tap_b->distance - tap_b->gap) * sum))};
}

// (q - q_c) / s where a column ends: at the edge, or `way` from it, half way to its neighbour, along its own surface.
INLINE floatV end_of(const sideV* side, const columnV* column, const edgeV* edge, float way, float inverse) {
    const floatV tilt = max(min(column->tilt, side->rises), side->falls);
    return select(fma(tilt, (floatV)way, column->front) * inverse, edge->place, edge->outward);
}

// The same towards the pixel. Between the pixel and its first sample nothing is known. A surface that rises towards the pixel is
// not followed there: seen at a grazing angle it would soon stand over the pixel.
INLINE floatV inner_end_of(const sideV* side, const columnV* column, const edgeV* edge, __global const tap_params* tap) {
    if (tap->gap < tap->distance)
        return end_of(side, column, edge, tap->after, tap->inverse_inner);
    const floatV tilt = max(min(column->tilt, side->rises), 0.0f);
    const floatV level = fma(tilt, (floatV)tap->after, column->front) * tap->inverse_inner;
    return select(max(level, column->front * tap->inverse_distance), edge->place, edge->outward);
}

// A part of a side, as (q - q_c) / s. It is empty where it ends before it begins.
typedef struct {
    floatV bottom, top;
} partV;

INLINE partV no_part(void) {
    return (partV){(floatV)INFINITY, (floatV)-INFINITY};
}

#define ALMOST 0.125f // of the way to a crease that a surface may lack, so that nothing changes at once
#define FALLS 1.5f    // times the steepest slope that it falls along

// (q - q_c) / s where the part that a sample blocks begins. If its surface, on which the next sample lies as well, comes down to what
// the last sample sees when it is followed towards the pixel by `to_crease` pixels, both meet in a crease, and nothing is open
// between them. A surface that is seen at a grazing angle would leave dashes of light there.
INLINE floatV down_to_crease(const sideV* side, const columnV* last, const columnV* column, const columnV* next,
                             __global const tap_params* tap,
                             float to_crease, const boundsV* within, floatV first, floatV bottom) {
    const floatV almost = (ALMOST * min(tap->gap, to_crease)) * min(min(column->tilt, 2.0f * next->tilt), FALLS * side->rises);
    const floatV beyond = fma(almost, (floatV)(1.0f / ALMOST + 1.0f), last->front - column->front);
    const floatV crease = tap->gap < tap->distance ? max(last->front * tap[-1].inverse_distance, first) : first;
    const intV meets = (beyond > 0.0f) & (almost > 0.0f) & (crease < min(bottom, within->high)) & within->counts;
    if (!any_of(meets))
        return bottom;
    const floatV part = select((floatV)0.0f, min(beyond * rough_inverse(almost), 1.0f), meets);
    return fma(part, min(crease, bottom) - bottom, bottom);
}

// The part that a column blocks: from `bottom` to the higher end of its front, inside the sphere. Each pixel counts only the
// samples that could block a sector of its own, so that its result does not depend on the other pixels of the vector.
INLINE partV part_of(const boundsV* within, floatV first, floatV bottom, floatV inner, floatV outer) {
    const floatV low = within->low, high = within->high;
    const intV counts = within->counts & (max(inner, outer) > first);
    const partV none = no_part();
    return (partV){select(none.bottom, max(min(bottom, high), low), counts),
                   select(none.top, max(min(max(inner, outer), high), low), counts)};
}

#endif
