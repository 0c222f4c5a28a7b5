// Visibility, confidence or bent normals: the mean of the slices' sums over the pixels around, which have other jitter
// patterns.
//   visibility = 1 - sum_n w_n B_n / sum_n w_n G_n
// A 5 x 5 window whose outermost rows and columns count half holds each of 16 patterns equally often; a 3 x 3 window
// does so for 4 patterns. There two opposite neighbours count only together, so that a missing one does not shift the
// mean. A neighbour's weight falls with its distance from the pixel's tangent plane, and with the pixel's distance from
// the neighbour's tangent plane, both in inverse depth. So nothing is mixed across an edge.
// Where few neighbours lie on the pixel's plane, as on strands and far ridges, so few slices would be dots: visibility is then partly
// what all pixels around see.
// One wall of a crease has too few patterns beside the crease, and both walls see the same there. So visibility has a second
// mean, for which what lies above the other's plane is closer. As visibility falls towards a crease, this mean counts where it is
// darker; where it is lighter it counts in part, and not on steep walls, whose pixels lie far apart.
// Built for: PERSPECTIVE = 0 1; REACH = 0 1 2; OUTPUT = 0 1 2; CLAMP = 0 1

#include "ssao/blocks.h"
#include "ssao/ray.h"
#include "ssao/split.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in the camera centre, 0 where they are parallel (orthographic)"
#endif
#ifndef REACH
#error "REACH is not defined: pixels on either side that hold every pattern: 2 for 16 of them, 1 for 4, 0 for one"
#endif

#ifndef OUTPUT
#error "OUTPUT is not defined: 0 visibility, 1 confidence, 2 bent normal"
#endif
#ifndef CLAMP
#error "CLAMP is not defined: 1 where planes hold repeated pixels outside the image, 0 otherwise"
#endif
#if OUTPUT == 2
#define SUMS 3
#else
#define SUMS 2
#endif

#define PAIRS (REACH == 1)
#define INWARD 0.125f                  // of the distance above the other's plane, in the second mean
#define LIGHTER (PAIRS ? 0.0f : 0.45f) // how much the second mean counts where it is lighter
// Widths of a pixel that a surface rises from one to the next: what is not steep, and what may go on to a crease.
#define GENTLE 2.0f
#define GRAZING 8.0f
// Weights of the eight next pixels below which a pixel is alone, and how much what all around see counts where none has any.
#define ALONE (PAIRS ? 1.0f : 2.1f)
#define OTHERS (PAIRS ? 0.4f : 1.0f)
// What a corner of the window lies above the pixel's plane where a crease may cross the window, as weights have it.
#define CREASE_LEAST 0.25f
#define CREASE_MOST 16.0f

// The pixel of each lane, and its surroundings in inverse depth.
typedef struct {
    int x, y, column; // x in the split image's first plane
    floatV q, right, down;
    floatV inverse; // 1 / the distance that a neighbour may lie off the tangent plane
    intV grazing;
} centreV;

// What the pixels of four neighbouring columns of V read, each once: row dy and column dx at [dy + REACH][dx + REACH].
#define ACROSS (4 + 2 * REACH)
#define DOWN (1 + 2 * REACH)
typedef struct {
    floatV front, slopes, sums[SUMS];
} nearV;

#if CLAMP
// Does the image itself hold the pixels `x` to the right of those of the first plane, in row y?
INLINE intV is_inside(const split_params* split, int column, int x, int y) {
    const intV at = 4 * ((intV)column + LANE_INDEX(int)) + (x - (int)(split->pixel_x & 3));
    return (at >= 0) & (at < (int)split->width) & (intV)(y >= 0 && y < (int)split->height ? -1 : 0);
}
#endif

// May its surface go on to a crease? What is steeper may be the side of a thin object, which ends behind its rim.
INLINE intV is_grazing(const nearV* its, const occlusion_params* p) {
    const floatV most = GRAZING * p->pixel * (PERSPECTIVE ? its->front : (floatV)1.0f);
    return fma(slope_right(its->slopes), slope_right(its->slopes), slope_down(its->slopes) * slope_down(its->slopes)) < most * most;
}

// How far a neighbour lies from the pixel's tangent plane, or the pixel from its, whichever is more. In the second mean less of
// what lies above counts.
INLINE floatV off_at(const nearV* its, const split_params* split, const centreV* c, int dx, int dy, bool second,
                     const occlusion_params* p) {
    const floatV between = its->front - c->q;
    const floatV beyond = between - fma(c->right, (floatV)(float)dx, c->down * (float)dy);
    const floatV behind = fma(slope_right(its->slopes), (floatV)(float)dx, slope_down(its->slopes) * (float)dy) - between;
    floatV off = max(fabs(beyond), fabs(behind));
    if (second) {
        const floatV inward = select((floatV)1.0f, (floatV)INWARD, c->grazing & is_grazing(its, p));
        off = max(inward * max(beyond, behind), max(-beyond, -behind));
    }
#if CLAMP
    return select((floatV)INFINITY, off, is_inside(split, c->column, c->x + dx, c->y + dy));
#else
    return off;
#endif
}

INLINE floatV weight_of(const centreV* c, floatV off, int dx, int dy) {
    const float fraction = (abs(dx) == REACH ? 0.5f : 1.0f) * (abs(dy) == REACH ? 0.5f : 1.0f);
    return fraction * max(fma(-off, c->inverse, (floatV)1.0f), 0.0f);
}

// Adds a neighbour of column j to the sums, or two opposite ones. Gives what it weighs, or what the two would weigh each by itself.
INLINE floatV add_neighbour(const nearV around[DOWN][ACROSS], const split_params* split, const centreV* c, int j, int dx, int dy,
                          bool second, const occlusion_params* p, floatV* sum) {
    const nearV* const its = &around[dy + REACH][j + dx + REACH];
    floatV off = off_at(its, split, c, dx, dy, second, p);
#if PAIRS
    const nearV* const opposite = &around[REACH - dy][j - dx + REACH];
    const floatV off_opposite = off_at(opposite, split, c, -dx, -dy, second, p);
    const floatV apart = weight_of(c, off, dx, dy) + weight_of(c, off_opposite, dx, dy);
    off = max(off, off_opposite);
#endif
    const floatV weight = weight_of(c, off, dx, dy);
    for (int i = 0; i < SUMS; ++i) {
        floatV value = its->sums[i];
#if PAIRS
        value += opposite->sums[i];
#endif
        sum[i] = fma(weight, value, sum[i]);
    }
#if PAIRS
    return apart;
#else
    return weight;
#endif
}

#if OUTPUT < 2 && REACH > 0
// What all pixels around see. Their planes are not the pixel's own, so that its sums are no measure for theirs.
INLINE floatV seen_around(const nearV around[DOWN][ACROSS], int j) {
    floatV sum[SUMS];
    for (int i = 0; i < SUMS; ++i) {
        sum[i] = 0.0f;
        for (int dy = -REACH; dy <= REACH; ++dy) {
            for (int dx = -REACH; dx <= REACH; ++dx)
                sum[i] += around[dy + REACH][j + dx + REACH].sums[i];
        }
    }
    return sum[0] / max(sum[1], 1e-30f);
}
#endif

#if OUTPUT == 0 && REACH > 0
// May a crease cross the window? Then it cuts off a corner, which lies above the pixel's plane.
INLINE intV is_crease(const nearV around[DOWN][ACROSS], const centreV* c, int j) {
    intV found = 0;
    for (int dy = -REACH; dy <= REACH; dy += 2 * REACH) {
        for (int dx = -REACH; dx <= REACH; dx += 2 * REACH) {
            const floatV beyond = around[dy + REACH][j + dx + REACH].front - c->q - fma(c->right, (floatV)(float)dx, c->down * (float)dy);
            const floatV above = beyond * c->inverse;
            found |= (above > CREASE_LEAST) & (above < CREASE_MOST);
        }
    }
    return found;
}
#endif

KERNEL void denoise(__global const float* fronts, __global const float* slopes, __global const float* sums,
                      __global const uint* blocks, __global float* target, const grid_params grid,
                      const split_params split, const band_params rows, const block_params work,
                      const occlusion_params p) {
    const int column = (int)get_global_id(0) * V;
    const int y = (int)get_global_id(1) + (int)grid.y_begin;
    if (column >= (int)split.columns)
        return;
    if (!is_needed(blocks, &work, (int)(split.pixel_x & ~3u) + 4 * column, 4 * V, y + (int)split.pixel_y))
        return;

#if OUTPUT == 0
    const uint which[SUMS] = {0, rows.sums};
#elif OUTPUT == 1
    const uint which[SUMS] = {2 * rows.sums, rows.sums};
#else
    const uint which[SUMS] = {3 * rows.sums, 4 * rows.sums, 5 * rows.sums};
#endif

    const int v = y + (int)(split.pixel_y & 3);
    nearV around[DOWN][ACROSS];
    intV some = 0; // sums outside the image are undefined: a wrong "blocked" costs time and changes no bit
    for (int dy = -REACH; dy <= REACH; ++dy) {
        for (int dx = -REACH; dx < 4 + REACH; ++dx) {
            nearV* const its = &around[dy + REACH][dx + REACH];
            const int plane = ((v + dy) & 3) * 4 + (dx & 3), its_column = column + (dx >> 2), row = (v + dy) >> 2;
            const uint at = in_plane(&split, plane, its_column, row);
            const uint at_sums = in_sums(&split, &rows, plane, its_column, row);
            its->front = LOAD(float, fronts + at);
            its->slopes = LOAD(float, slopes + at);
#if CLAMP
            const intV counts = (its->front > NOTHING) & is_inside(&split, column, dx, y + dy);
#else
            const intV counts = its->front > NOTHING;
#endif
            for (int i = 0; i < SUMS; ++i)
                its->sums[i] = select((floatV)0.0f, LOAD(float, sums + which[i] + at_sums), counts);
            some |= its->sums[0] > 0.0f;
        }
    }
    const bool open = OUTPUT == 0 && !any_of(some);

    floatV dealt[OUTPUT == 2 ? 3 : 1][4];
    for (int j = 0; j < 4; ++j) {
        const nearV* const here = &around[REACH][j + REACH];
        centreV c = {j, y, column, here->front};
        floatV sum[SUMS];
        c.right = slope_right(here->slopes), c.down = slope_down(here->slopes);
        // A pixel's width on the surface, as inverse depth: what a face at 45 degrees would differ by.
        const floatV size = PERSPECTIVE ? fabs(c.q) * p.pixel : (floatV)p.pixel;
        const floatV steep = fma(c.right, c.right, c.down * c.down);
        c.inverse = 1.0f / (p.edge * sqrt(fma(size, size, steep)) + 4 * depth_error(&p, c.q));
        for (int i = 0; i < SUMS; ++i)
            sum[i] = here->sums[i];
        floatV next = 0.0f; // weights of the eight next pixels
        for (int dy = PAIRS ? 0 : -REACH; !open && dy <= REACH; ++dy) {
            for (int dx = PAIRS && dy == 0 ? 1 : -REACH; dx <= REACH; ++dx) {
                if (dx != 0 || dy != 0) {
                    const floatV weight = add_neighbour(around, &split, &c, j, dx, dy, false, &p, sum);
                    if (abs(dx) < 2 && abs(dy) < 2)
                        next += weight;
                }
            }
        }
        (void)next; // without neighbours, and for normals
        const intV known = c.q > 1.5f * NOTHING, surface = c.q > NOTHING;
#if OUTPUT == 2
        const floatV length = sqrt(fma(sum[0], sum[0], fma(sum[1], sum[1], sum[2] * sum[2])));
        for (int i = 0; i < 3; ++i) {
            const floatV unit = select((floatV)0.0f, sum[i] / length, surface & (length > 0.0f));
            dealt[i][j] = select((floatV)NAN, unit, known);
        }
#else
        floatV fraction = sum[0] / max(sum[1], 1e-30f);
#if REACH > 0
        const floatV alone = open ? (floatV)0.0f : max(fma((floatV)(-1.0f / ALONE), next, (floatV)1.0f), 0.0f);
        if (any_of(alone > 0.0f))
            fraction = fma(OTHERS * alone, seen_around(around, j) - fraction, fraction);
#endif
#if OUTPUT == 0 && REACH > 0
        const intV crease = open ? (intV)0 : is_crease(around, &c, j);
        if (any_of(crease)) {
            c.grazing = is_grazing(here, &p);
            floatV both[SUMS] = {here->sums[0], here->sums[1]};
#pragma unroll 1 // four copies of this loop would cost every pixel a tenth of its time
            for (int dy = PAIRS ? 0 : -REACH; dy <= REACH; ++dy) {
#pragma unroll 1
                for (int dx = PAIRS && dy == 0 ? 1 : -REACH; dx <= REACH; ++dx) {
                    if (dx != 0 || dy != 0)
                        add_neighbour(around, &split, &c, j, dx, dy, true, &p, both);
                }
            }
            const floatV darker = both[0] / max(both[1], 1e-30f) - fraction;
            const floatV lighter = select((floatV)0.0f, (floatV)LIGHTER, steep < GENTLE * GENTLE * size * size);
            fraction += select((floatV)0.0f, max(darker, lighter * darker), c.grazing & crease);
        }
#endif
        const floatV result = min(max(OUTPUT == 0 ? 1.0f - fraction : fraction, 0.0f), 1.0f);
        dealt[0][j] = select(select((floatV)NAN, (floatV)1.0f, known), result, surface);
#endif
    }

    // The columns of the region, from its own first one on.
    const int left = 4 * column - (int)(split.pixel_x & 3), first = (int)grid.x_begin, end = (int)grid.x_end;
    __global float* to = target + grid.target_offset + (size_t)get_global_id(1) * grid.target_stride;
#if OUTPUT == 2
    for (int i = 0; i < 3; ++i) {
        floatV row[4];
        RIFFLE(dealt[i], row);
        for (int j = 0; j < 4; ++j) {
            const float_lanes values = row[j];
            for (int lane = 0; lane < V; ++lane) {
                const int x = left + j * V + lane;
                if (x >= first && x < end)
                    to[3 * (x - first) + i] = ((const float*)&values)[lane];
            }
        }
    }
#else
    floatV row[4];
    RIFFLE(dealt[0], row);
    for (int j = 0; j < 4; ++j) {
        const int x = left + j * V;
        if (x >= first && x + V <= end) {
            *(__global float_lanes*)(to + (x - first)) = row[j];
        } else {
            const float_lanes values = row[j];
            for (int lane = 0; lane < V; ++lane) {
                if (x + lane >= first && x + lane < end)
                    to[x + lane - first] = ((const float*)&values)[lane];
            }
        }
    }
#endif
}
