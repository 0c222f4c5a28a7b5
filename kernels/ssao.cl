// Ambient occlusion from inverse depth, V pixels of one jitter pattern per work-item.
//   visibility = 1 - sum_slices w B / sum_slices w G,   w = dphi(view ray) / dphi(screen)
// A slice is the plane through the view ray and a direction on the screen; B of its cosine-weighted measure
//   G(t) = 1/2 [sin^2 t + nu (t - sin t cos t)],  nu = n.T / n.V,  t from the view ray to the tangent plane
// is blocked by what neighbouring pixels show: columns along their own rays, from the surface to `back`, cut off at the
// sphere of the radius. In inverse depth the cotangent of t is affine in (q - q_c) / s, s pixels away: no square root but
// that of the sphere, no angle, and the tangent plane is exact under every camera. A side of a slice is 31 sectors of the same
// measure, one bit each: one maximum a side, the horizon, would block what lies below a far column's chord of the sphere.
// Jimenez et al. 2016 (slices, the measure); Therrien et al. 2023 (bits); Mara et al. 2013 (split planes). Slices are
// weighted to be uniform around the view ray, not on the screen.
// Built for: PERSPECTIVE = 0 1; CONFIDENCE = 0 1; BENT = 0 1

#include "blocks.h"
#include "ray.h"
#include "split.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in the camera centre, 0 where they are parallel (orthographic)"
#endif

#ifndef CONFIDENCE
#error "CONFIDENCE is not defined: 1 to sum how much of the slices lay on known pixels, 0 otherwise"
#endif
#ifndef BENT
#error "BENT is not defined: 1 to sum the open directions, 0 otherwise"
#endif

#define STORE(target, value) *(__global float_lanes*)(target) = (value)
#define SECTORS 31.0f
// Fraction of the radius that a surface may rise from one pixel to the next. A steeper step is an edge, unless the tangent
// plane is as steep.
#define STEEP 0.5f

#if BENT
#define BENT_ANGLES 24 // cosine and sine of (i + 1/2) pi / 24
__constant float bent_angles[BENT_ANGLES][2] = {
    {0.997858923f, 0.065403129f},  {0.980785280f, 0.195090322f},  {0.946930129f, 0.321439465f},
    {0.896872742f, 0.442288690f},  {0.831469612f, 0.555570233f},  {0.751839807f, 0.659345815f},
    {0.659345815f, 0.751839807f},  {0.555570233f, 0.831469612f},  {0.442288690f, 0.896872742f},
    {0.321439465f, 0.946930129f},  {0.195090322f, 0.980785280f},  {0.065403129f, 0.997858923f},
    {-0.065403129f, 0.997858923f}, {-0.195090322f, 0.980785280f}, {-0.321439465f, 0.946930129f},
    {-0.442288690f, 0.896872742f}, {-0.555570233f, 0.831469612f}, {-0.659345815f, 0.751839807f},
    {-0.751839807f, 0.659345815f}, {-0.831469612f, 0.555570233f}, {-0.896872742f, 0.442288690f},
    {-0.946930129f, 0.321439465f}, {-0.980785280f, 0.195090322f}, {-0.997858923f, 0.065403129f},
};
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

// asin c + c sqrt(1 - c^2) to 1.4e-3, exact at 0 and 1.
INLINE floatV lens(floatV c) {
    const floatV c2 = c * c;
    const floatV h = fma(c2, fma(c2, (floatV)-0.211485824f, (floatV)0.210784609f), (floatV)-0.439477174f);
    return c * fma(c2, h, (floatV)2.01097472f);
}

// Twice the measure from the view ray to the angle of cosine c.
INLINE floatV measure(floatV c, floatV nu) {
    return fma(-c, c, (floatV)1.0f) + nu * ((float)M_PI_2_F - lens(c));
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

// One side of a slice: cot t = scale (q - q_c) / s + offset, see the head.
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

INLINE sphereV sphere_at(const sideV* side, __global const tap_params* tap) {
    const floatV reach = fma((floatV)-tap->distance, side->reach_step, side->reach);
    const floatV square = max(fma((floatV)-tap->square_distance, side->cut, reach * reach), 0.0f);
    const floatV half_length = square * rough_inverse_root(square);
    const floatV middle = fma((floatV)-tap->distance, side->middle_step, side->middle);
    return (sphereV){fma(-half_length, side->per_depth, middle),
                   max(fma(half_length, side->per_depth, middle), side->nearest)};
}

// Sectors between the tangent plane and an angle, as a count.
INLINE intV sectors_to(floatV cotangent, const sideV* side) {
    const floatV c = max(cotangent * rough_inverse_root(fma(cotangent, cotangent, (floatV)1.0f)), side->lowest);
    return convert_intV(fma(c * c, side->sectors_square, fma(lens(c), side->sectors_nu, side->sectors_offset)));
}

// Where the work-item's pixels lie in the split image.
typedef struct {
    uint here;
    int column, row;
    bool inside; // no tap leaves it
} placeV;

INLINE placeV place_at(uint here, int column, int row, int reach, const split_params* split) {
    const bool inside_row = column >= reach && column + V + reach <= (int)split->columns;
    return (placeV){here, column, row, inside_row && row >= reach && row + reach < (int)split->rows};
}

// The pixels of this work-item. A launch has one dimension. It goes through the planes in bands of columns, so that the samples
// of neighbouring items stay in the cache, and through all patterns of a row before the next row.
typedef struct {
    int pattern, column, row;
} itemV;

INLINE itemV item_of(const band_params* rows) {
    const uint item = (uint)get_global_id(0), wide = ssao_band / V, band_items = wide * split_planes * rows->rows;
    const uint band = item / band_items, in_band = item % band_items;
    return (itemV){(int)(in_band / wide % split_planes), (int)(band * ssao_band + in_band % wide * V),
                   (int)(rows->first + in_band / wide / split_planes)};
}

INLINE uint at_tap(const placeV* place, const split_params* split, __global const tap_params* tap) {
    const uint at = place->here + (uint)tap->offset;
    if (place->inside)
        return at;
    const int column = place->column + ((tap->rows_columns << 16) >> 16), row = place->row + (tap->rows_columns >> 16);
    return at + (uint)(clamp(row, -1, (int)split->rows) - row) * split->stride +
           (uint)(clamp(column, -split_margin, (int)split->columns) - column);
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

// The sectors of a part.
INLINE intV sectors_of(const sideV* side, const partV* part) {
    const intV from = max(sectors_to(fma(side->scale, part->bottom, side->offset), side), 0);
    const intV to = min(max(sectors_to(fma(side->scale, part->top, side->offset), side), from), (int)SECTORS);
    return ((intV)1 << to) - ((intV)1 << from);
}

// The part that a column blocks: from its back to the higher end of its front, inside the sphere. Each pixel counts only the
// samples that could block a sector of its own, so that its result does not depend on the other pixels of the vector.
INLINE partV part_of(const boundsV* within, floatV first, const columnV* column, floatV back, floatV inner, floatV outer,
                     __global const tap_params* tap) {
    const floatV low = within->low, high = within->high;
    const floatV behind = (back + column->to_line) * tap->inverse_distance;
    const intV counts = within->counts & (max(inner, outer) > first);
    const partV none = no_part();
    return (partV){select(none.bottom, max(min(min(min(inner, outer), behind), high), low), counts),
                   select(none.top, max(min(max(inner, outer), high), low), counts)};
}

// Neighbouring columns mostly block parts that overlap. One that lies apart sets the sectors of those before it.
INLINE intV join(const sideV* side, partV* parts, const partV* next) {
    const intV apart = (next->top >= next->bottom) & (parts->top >= parts->bottom) &
                       ((next->bottom > parts->top) | (next->top < parts->bottom));
    intV covered = 0;
    if (any_of(apart)) {
        const partV none = no_part();
        covered = select((intV)0, sectors_of(side, parts), apart);
        parts->bottom = select(parts->bottom, none.bottom, apart);
        parts->top = select(parts->top, none.top, apart);
    }
    parts->bottom = min(parts->bottom, next->bottom);
    parts->top = max(parts->top, next->top);
    return covered;
}

INLINE pixelV pixel_at(__global const float* fronts, __global const float* slopes, const split_params* split,
                       const occlusion_params* p, uint here, int pattern, int column, int row) {
    pixelV c;
    const floatV front = LOAD(float, fronts + here), packed = LOAD(float, slopes + here);
    c.surface = front > NOTHING;
    c.q = select((floatV)(PERSPECTIVE ? 1.0f : 0.0f), front, c.surface);
    c.error = depth_error(p, c.q);
    c.right = slope_right(packed), c.down = slope_down(packed);
    const float y = (float)(4 * row + pattern / 4 + (int)(split->pixel_y & ~3u)) + 0.5f;
    const float first_x = (float)(pattern % 4 + (int)(split->pixel_x & ~3u)) + 0.5f;
    const floatV x = fma((floatV)4.0f, convert_floatV((intV)column + LANE_INDEX(int)), (floatV)first_x);
    for (int i = 0; i < 3; ++i)
        c.direction[i] = direction_at(p, i, x, y);
    const floatV square =
        fma(c.direction[0], c.direction[0], fma(c.direction[1], c.direction[1], c.direction[2] * c.direction[2]));
    c.inverse_length = 1.0f / sqrt(square);
    c.length = square * c.inverse_length;
    for (int k = 0; k < 2; ++k) {
        const floatV dot_step =
            fma(c.direction[0], p->step[0][k], fma(c.direction[1], p->step[1][k], c.direction[2] * p->step[2][k]));
        c.along[k] = -c.inverse_length * dot_step;
    }
#if PERSPECTIVE
    c.distance = c.length / c.q;
    c.steepest = c.q * c.q * (STEEP * p->radius) * c.inverse_length;
#else
    c.distance = 1.0f;
    c.steepest = STEEP * p->radius * c.inverse_length;
#endif
    return c;
}

INLINE sliceV slice_at(const pixelV* c, const occlusion_params* p, __global const float* turn) {
    sliceV slice = {turn[0], turn[1], p->radius * turn[2], turn[3]};
    float square = 0;
    for (int i = 0; i < 3; ++i) {
        const float step = slice.x * p->step[i][0] + slice.y * p->step[i][1];
        square += step * step;
    }
    slice.along = fma((floatV)slice.x, c->along[0], slice.y * c->along[1]);
    slice.across_square = fma(-slice.along, slice.along, (floatV)square);
    slice.inverse_across = inverse_root(slice.across_square);
    slice.slope = fma((floatV)slice.x, c->right, slice.y * c->down);
    return slice;
}

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

// Where sectors begin on a side of a slice, and from where on the first may be blocked.
INLINE void set_sectors(sideV* side, floatV tangent, float rounding) {
    side->lowest = tangent * inverse_root(fma(tangent, tangent, (floatV)1.0f));
    side->nu = -tangent;
    side->whole = max(measure(side->lowest, side->nu), 1e-6f);
    const floatV per_sector = SECTORS * rough_inverse(side->whole);
    side->sectors_square = per_sector;
    side->sectors_nu = per_sector * side->nu;
    side->sectors_offset = SECTORS + rounding - per_sector * fma(side->nu, (floatV)M_PI_2_F, (floatV)1.0f);

    // A sector's measure is at most root(1 + nu^2) times the square of the angle above the tangent plane.
    const floatV square =
        side->whole * ((1.0f - rounding) / SECTORS) * rough_inverse_root(fma(tangent, tangent, (floatV)1.0f));
    const floatV above = square * rough_inverse_root(square);
    const floatV sky = fma(-tangent, above, (floatV)1.0f);
    const floatV first = fma(tangent + above, rough_inverse(sky), -side->offset) * rough_inverse(side->scale);
    side->first = select((floatV)INFINITY, first, sky > 0.0f);
}

INLINE sideV side_at(const pixelV* c, const sliceV* slice, float sign, float slope_errors) {
    sideV side = {-slice->y, slice->x, sign * slice->x, sign * slice->y};
    side.q = c->q + 2.0f * c->error;
    side.slack = 4.0f * c->error;
    side.across = fma((floatV)-slice->y, c->right, slice->x * c->down);
    side.tangent = sign * slice->slope;
    side.rises = max(side.tangent, c->steepest);
    side.falls = min(side.tangent, -c->steepest);
    set_sphere(&side, c, slice, sign);
    side.scale = (PERSPECTIVE ? c->distance : c->length) * slice->inverse_across;
    const floatV flat = sign * slice->along * slice->inverse_across;
    side.offset = flat - side.scale * (slope_errors * c->error); // so that only what is certainly higher counts
    set_sectors(&side, fma(side.scale, side.tangent, flat), slice->rounding);
    return side;
}

// The images and tables that a walk along a slice reads.
typedef struct {
    __global const float *fronts, *backs, *slopes;
    const split_params* split;
} sourceV;

// Which of the next taps, 32 at most, may block a sector of any lane.
INLINE uint rising_taps(const sideV* side, const sourceV* from, const placeV* place, floatV first,
                        __global const tap_params* tap, int count) {
    intV rising = 0, bit = 1;
    for (int i = 0; i < count; ++i) {
        const uint at = at_tap(place, from->split, tap + i);
        READ_NEXT(from->slopes + at);
        READ_NEXT(from->fronts + at);
        const columnV seen = column_at(side, from->fronts, from->slopes, at, tap + i);
        rising |= select((intV)0, bit, peak_of(&seen, tap + i) > first);
        bit += bit;
    }
    return (uint)bits_of_any(rising);
}

INLINE intV sectors_of_taps(const sideV* side, const sourceV* from, const placeV* place, floatV first,
                            __global const tap_params* taps, uint rising) {
    intV covered = 0;
    partV parts = no_part();
    columnV seen, next;
    edgeV before, after;
    for (int known = -1; rising != 0; rising &= rising - 1) {
        const int i = 31 - clz(rising & -rising);
        __global const tap_params* const tap = taps + i;
        const uint at = at_tap(place, from->split, tap);
        if (i == known)
            seen = next;
        else
            seen = column_at(side, from->fronts, from->slopes, at, tap);
        const boundsV within = bounds_at(side, first, &seen, tap);
        if (!any_of(within.counts))
            continue;
        if (i == known) {
            before = after;
        } else {
            const columnV last =
                column_at(side, from->fronts, from->slopes, at_tap(place, from->split, tap - 1), tap - 1);
            before = edge_of(&last, &seen, tap);
        }
        known = i + 1;
        READ_NEXT(from->backs + at);
        next = column_at(side, from->fronts, from->slopes, at_tap(place, from->split, tap + 1), tap + 1);
        after = edge_of(&seen, &next, tap + 1);
        const floatV inner = inner_end_of(side, &seen, &before, tap);
        const floatV outer = end_of(side, &seen, &after, tap[1].before, tap[1].inverse_inner);
        const partV part = part_of(&within, first, &seen, LOAD(float, from->backs + at), inner, outer, tap);
        covered |= join(side, &parts, &part);
    }
    return covered | select((intV)0, sectors_of(side, &parts), parts.top >= parts.bottom);
}

#if CONFIDENCE
// The fraction of the taps within reach that lie on known pixels.
INLINE floatV known_fraction(const sideV* side, const sourceV* from, const placeV* place, __global const tap_params* tap,
                             int count) {
    floatV asked = 0.0f, answered = 0.0f;
    for (int i = 0; i < count; ++i) {
        const floatV within = select((floatV)0.0f, (floatV)1.0f, tap[i].distance <= side->extent);
        asked += within;
        const floatV front = LOAD(float, from->fronts + at_tap(place, from->split, tap + i));
        answered += select((floatV)0.0f, within, front > 1.5f * NOTHING);
    }
    return select((floatV)1.0f, answered / max(asked, 1e-9f), asked > 0.0f);
}
#endif

#if BENT
// Adds the open directions of a side of a slice, weighted by the cosine.
INLINE void add_open(const sideV* side, const sliceV* slice, const pixelV* c, const occlusion_params* p, float sign,
                     intV found, floatV weight, floatV* bent) {
    floatV open_along = 0.0f, open_across = 0.0f;
    for (int i = 0; i < BENT_ANGLES; ++i) {
        const float cosine = bent_angles[i][0], sine = bent_angles[i][1];
        const floatV density = max(fma(side->nu, (floatV)sine, (floatV)cosine), 0.0f) * sine;
        const floatV turned = fma((floatV)(cosine * cosine), side->sectors_square,
                                  fma(lens((floatV)cosine), side->sectors_nu, side->sectors_offset));
        const intV bit = clamp(convert_intV(clamp(turned, 0.0f, SECTORS)), 0, 30);
        const floatV open = select(density, (floatV)0.0f, ((found >> bit) & 1) != 0);
        open_along = fma(open, (floatV)cosine, open_along);
        open_across = fma(open, (floatV)sine, open_across);
    }
    // Along the view ray, and along the slice's tangent: what of the step is across that.
    const floatV on_step = sign * open_across * slice->inverse_across * weight;
    const floatV on_ray = -c->inverse_length * fma(-on_step, slice->along, open_along * weight);
    for (int i = 0; i < 3; ++i)
        bent[i] += fma(on_ray, c->direction[i], on_step * fma(slice->x, p->step[i][0], slice->y * p->step[i][1]));
}
#endif

KERNEL void ssao(__global const float* fronts, __global const float* backs, __global const float* slopes,
                   __global const float* taps, __global const float* turns, __global const uint* counts,
                   __global const uint* blocks, __global float* sums, const split_params split, const band_params rows,
                   const block_params work, const occlusion_params p) {
    const itemV item = item_of(&rows);
    const int pattern = item.pattern, column = item.column, row = item.row;
    if (column >= (int)split.columns)
        return;
    const int x = (int)(split.pixel_x & ~3u) + 4 * column + pattern % 4;
    if (!is_needed(blocks, &work, x, 4 * V - 3, (int)(split.pixel_y & ~3u) + 4 * row + pattern / 4))
        return;

    const uint here = in_plane(&split, pattern, column, row);
    const pixelV c = pixel_at(fronts, slopes, &split, &p, here, pattern, column, row);
    const sourceV from = {fronts, backs, slopes, &split};
    floatV blocked = 0.0f, whole = 0.0f;
#if CONFIDENCE
    floatV known = 0.0f;
#endif
#if BENT
    floatV bent[3] = {0.0f, 0.0f, 0.0f};
#endif
    for (uint k = 0; k < p.slices; ++k) {
        const sliceV slice = slice_at(&c, &p, turns + 4 * (pattern * p.slices + k));
        const floatV weight = slice.inverse_across * slice.inverse_across;
        for (int back = 0; back < 2; ++back) {
            const float sign = back ? -1.0f : 1.0f;
            const sideV side = side_at(&c, &slice, sign, p.slope_errors);
            const intV levels = min(((as_intV(side.extent * side.extent) + 0x7fffff) >> 23) - 127, (intV)(int)p.levels);
            intV found = 0, left_over = select((intV)0, levels, c.surface);
#if CONFIDENCE
            floatV answered = 1.0f;
#endif
            // Lanes whose sphere covers about as many pixels share a table of taps.
            for (int level = greatest(left_over); level > 0; level = greatest(left_over)) {
                const intV active = left_over == level;
                const floatV first = select((floatV)INFINITY, side.first, active);
                const int count = (int)counts[level];
                const uint table = ((uint)pattern * p.slices + k) * 2 + (uint)back;
                __global const tap_params* const tap =
                    (__global const tap_params*)taps + counts[2 * p.levels + level] + ((uint)count + 2) * table + 1;
                const placeV place = place_at(here, column, row, (int)counts[p.levels + level], &split);
                intV covered = 0;
                for (int done = 0; done < count; done += 32) {
                    const uint rising = rising_taps(&side, &from, &place, first, tap + done, min(count - done, 32));
                    covered |= sectors_of_taps(&side, &from, &place, first, tap + done, rising);
                }
                found = select(found, covered, active);
#if CONFIDENCE
                answered = select(answered, known_fraction(&side, &from, &place, tap, count), active);
#endif
                left_over = select(left_over, (intV)0, active);
            }
            const floatV measure_of_side = weight * side.whole;
            whole += measure_of_side;
            blocked = fma(measure_of_side * (1.0f / SECTORS), convert_floatV(popcount(found)), blocked);
#if CONFIDENCE
            known = fma(measure_of_side, answered, known);
#endif
#if BENT
            add_open(&side, &slice, &c, &p, sign, found, weight, bent);
#endif
        }
    }
    const uint target = in_sums(&split, &rows, pattern, column, row);
    STORE(sums + target, select((floatV)0.0f, blocked, c.surface));
    STORE(sums + rows.sums + target, select((floatV)0.0f, whole, c.surface));
#if CONFIDENCE
    STORE(sums + 2 * rows.sums + target, select((floatV)0.0f, known, c.surface));
#endif
#if BENT
    for (uint i = 0; i < 3; ++i)
        STORE(sums + (3 + i) * rows.sums + target, select((floatV)0.0f, bent[i], c.surface));
#endif
}
