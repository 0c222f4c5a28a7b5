// Ambient occlusion from inverse depth, V pixels of one jitter pattern per work-item: over slices, sides and samples.
//   visibility = 1 - sum_slices w B / sum_slices w G,   w = dphi(view ray) / dphi(screen)
// A slice is the plane through the view ray and a direction on the screen: the outer integral of Jimenez et al. 2016, eq. 5.
// B of its cosine-weighted measure G, see sectors.h, is blocked by what neighbouring pixels show, see column.h. Slices are
// weighted to be uniform around the view ray, not on the screen. Split planes: Mara et al. 2013.
// Built for: CONFIDENCE = 0 1; CLAMP = 0 1

#include "ssao/blocks.h"
#include "ssao/ray.h"
#include "ssao/sectors.h"

#ifndef CONFIDENCE
#error "CONFIDENCE is not defined: 1 to sum how much of the slices lay on known pixels, 0 otherwise"
#endif
#ifndef CLAMP
#error "CLAMP is not defined: 1 where planes hold repeated pixels outside the image, 0 otherwise"
#endif

#define STORE(target, value) *(__global float_lanes*)(target) = (value)
// Fraction of the radius that a surface may rise from one pixel to the next. A steeper step is an edge, unless the tangent
// plane is as steep.
#define STEEP 0.5f

// The pixels of this work-item. A launch has one dimension. It goes through the planes in bands of columns, so that the samples
// of neighbouring items stay in the cache, and through all patterns of a row before the next row.
typedef struct {
    int pattern, column, row;
} itemV;

INLINE itemV item_of(const band_params* rows) {
    const uint item = (uint)get_global_id(0), wide = ssao_band / V;
    const uint band_items = max(wide * split_planes * rows->rows, 1u); // none where it is compiled apart
    const uint band = item / band_items, in_band = item % band_items;
    return (itemV){(int)(in_band / wide % split_planes), (int)(band * ssao_band + in_band % wide * V),
                   (int)(rows->first + in_band / wide / split_planes)};
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

INLINE uint at_any_tap(const placeV* place, const split_params* split, __global const tap_params* tap) {
    const uint at = place->here + (uint)tap->offset;
    if (place->inside)
        return at;
    const int column = place->column + ((tap->rows_columns << 16) >> 16), row = place->row + (tap->rows_columns >> 16);
    return at + (uint)(clamp(row, -1, (int)split->rows) - row) * split->stride +
           (uint)(clamp(column, -split_margin, (int)split->columns) - column);
}

// The same for a tap that `taps_inside` counts: no lane of it lies beyond what the planes hold around the image.
INLINE uint at_tap(const placeV* place, const split_params* split, __global const tap_params* tap) {
    return CLAMP ? at_any_tap(place, split, tap) : place->here + (uint)tap->offset;
}

// How many of the taps lie in the image for some lane: a slice that has left it does not come back.
INLINE int taps_inside(const placeV* place, const split_params* split, __global const tap_params* taps, int count) {
    if (CLAMP || place->inside)
        return count;
    int least = 0;
    while (least < count) {
        const int middle = (least + count) / 2;
        const int column = place->column + ((taps[middle].rows_columns << 16) >> 16);
        const int row = place->row + (taps[middle].rows_columns >> 16);
        if (column + V > 0 && column < (int)split->columns && row >= 0 && row < (int)split->rows)
            least = middle + 1;
        else
            count = middle;
    }
    return least;
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
                            float to_crease, __global const tap_params* taps, uint rising) {
    intV covered = 0;
    partV parts = no_part();
    columnV last, seen, next;
    edgeV before, after;
    for (int known = -1; rising != 0; rising &= rising - 1) {
        const int i = 31 - clz(rising & -rising);
        __global const tap_params* const tap = taps + i;
        const uint at = at_tap(place, from->split, tap);
        if (i == known) {
            last = seen;
            seen = next;
        } else {
            seen = column_at(side, from->fronts, from->slopes, at, tap);
        }
        const boundsV within = bounds_at(side, first, &seen, tap);
        if (!any_of(within.counts))
            continue;
        if (i == known) {
            before = after;
        } else {
            last = column_at(side, from->fronts, from->slopes, at_tap(place, from->split, tap - 1), tap - 1);
            before = edge_of(&last, &seen, tap);
        }
        known = i + 1;
        READ_NEXT(from->backs + at);
        next = column_at(side, from->fronts, from->slopes, at_any_tap(place, from->split, tap + 1), tap + 1);
        after = edge_of(&seen, &next, tap + 1);
        const floatV inner = inner_end_of(side, &seen, &before, tap);
        const floatV outer = end_of(side, &seen, &after, tap[1].before, tap[1].inverse_inner);
        const floatV behind = (LOAD(float, from->backs + at) + seen.to_line) * tap->inverse_distance;
        floatV bottom = min(min(inner, outer), behind);
        if (to_crease > 0.0f)
            bottom = down_to_crease(side, &last, &seen, &next, tap, to_crease, &within, first, bottom);
        const partV part = part_of(&within, first, bottom, inner, outer);
        covered |= join(side, &parts, &part); // Therrien et al. 2023, algorithm 1, line 24
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
        const floatV front = LOAD(float, from->fronts + at_any_tap(place, from->split, tap + i));
        answered += select((floatV)0.0f, within, front > 1.5f * NOTHING);
    }
    return select((floatV)1.0f, answered / max(asked, 1e-9f), asked > 0.0f);
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
        const floatV weight = slice.inverse_across * slice.inverse_across; // dphi of eq. 5 for a slice of the screen
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
                const int inside = taps_inside(&place, &split, tap, count);
                intV covered = 0;
                for (int done = 0; done < inside; done += 32) {
                    const uint rising = rising_taps(&side, &from, &place, first, tap + done, min(inside - done, 32));
                    if (rising != 0)
                        covered |= sectors_of_taps(&side, &from, &place, first, p.crease, tap + done, rising);
                }
                found = select(found, covered, active);
#if CONFIDENCE
                answered = select(answered, known_fraction(&side, &from, &place, tap, count), active);
#endif
                left_over = select(left_over, (intV)0, active);
            }
            const floatV measure_of_side = weight * side.whole; // a side of eq. 7 up to the tangent plane
            whole += measure_of_side;
            // Therrien et al. 2023, algorithm 1, line 26.
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
