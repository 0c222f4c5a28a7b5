// Visibility, confidence or bent normals: the mean of the slices' sums over the pixels around, which have other jitter
// patterns.
//   visibility = 1 - sum_n w_n B_n / sum_n w_n G_n
// A 5 x 5 window whose outermost rows and columns count half holds each of 16 patterns equally often; a 3 x 3 window
// does so for 4 patterns. There two opposite neighbours count only together, so that a missing one does not shift the
// mean. A neighbour's weight falls with its distance from the pixel's tangent plane, and with the pixel's distance from
// the neighbour's tangent plane, both in inverse depth. So nothing is mixed across an edge.
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
#define INWARD 0.1875f                // of the distance above the other's plane, in the second mean
#define LIGHTER (PAIRS ? 0.0f : 0.4f) // how much the second mean counts where it is lighter
#define GENTLE 2.0f                   // widths of a pixel from one to the next, for a wall that is not steep

// The pixel of each lane, and its surroundings in inverse depth.
typedef struct {
    int x, y, column; // x in the split image's first plane
    floatV q, right, down;
    floatV inverse; // 1 / the distance that a neighbour may lie off the tangent plane
    floatV lighter; // how much of a lighter second mean counts
} centreV;

// What the pixels of four neighbouring columns of V read, each once: row dy and column dx at [dy + REACH][dx + REACH].
#define ACROSS (4 + 2 * REACH)
#define DOWN (1 + 2 * REACH)
typedef struct {
    floatV front, slopes, sums[SUMS];
    floatV inward; // INWARD, or 1 for what may be the side of a thin object
} nearV;

// How far a neighbour lies from the pixel's tangent plane, or the pixel from its, whichever is more; in either mean.
typedef struct {
    floatV off, off_second;
} offV;

INLINE offV off_at(const nearV* its, const nearV* here, const split_params* split, const centreV* c, int dx, int dy) {
    const floatV between = its->front - c->q;
    const floatV of_ours = fma(c->right, (floatV)(float)dx, c->down * (float)dy);
    const floatV of_its = fma(slope_right(its->slopes), (floatV)(float)dx, slope_down(its->slopes) * (float)dy);
    const floatV beyond = between - of_ours, behind = of_its - between, above = max(beyond, behind);
    const floatV below = max(-beyond, -behind);
    const offV found = {max(above, below), max(max(here->inward, its->inward) * above, below)};
#if CLAMP
    const intV x = 4 * ((intV)c->column + LANE_INDEX(int)) + (c->x + dx - (int)(split->pixel_x & 3));
    const int y = c->y + dy;
    const intV inside = (x >= 0) & (x < (int)split->width) & (intV)(y >= 0 && y < (int)split->height ? -1 : 0);
    return (offV){select((floatV)INFINITY, found.off, inside), select((floatV)INFINITY, found.off_second, inside)};
#else
    return found;
#endif
}

INLINE floatV weight_of(const centreV* c, floatV off, int dx, int dy) {
    const float fraction = (abs(dx) == REACH ? 0.5f : 1.0f) * (abs(dy) == REACH ? 0.5f : 1.0f);
    return fraction * max(fma(-off, c->inverse, (floatV)1.0f), 0.0f);
}

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
            for (int i = 0; i < SUMS; ++i)
                its->sums[i] = LOAD(float, sums + which[i] + at_sums);
            const floatV right = slope_right(its->slopes), down = slope_down(its->slopes);
            const floatV grazing = GRAZING * p.pixel * (PERSPECTIVE ? its->front : (floatV)1.0f);
            its->inward = select((floatV)1.0f, (floatV)INWARD, fma(right, right, down * down) < grazing * grazing);
            some |= its->sums[0] > 0.0f;
        }
    }
    const bool open = OUTPUT == 0 && !any_of(some);

    floatV dealt[OUTPUT == 2 ? 3 : 1][4];
    for (int j = 0; j < 4; ++j) {
        const nearV* const here = &around[REACH][j + REACH];
        centreV c = {j, y, column, here->front};
        floatV sum[SUMS], second[2] = {0.0f, 0.0f}; // what the second mean has more
        for (int i = 0; i < SUMS; ++i)
            sum[i] = here->sums[i];
        c.right = slope_right(here->slopes), c.down = slope_down(here->slopes);
        // A pixel's width on the surface, as inverse depth: what a face at 45 degrees would differ by.
        const floatV size = PERSPECTIVE ? fabs(c.q) * p.pixel : (floatV)p.pixel;
        const floatV steep = fma(c.right, c.right, c.down * c.down);
        c.lighter = select((floatV)0.0f, (floatV)LIGHTER, steep < GENTLE * GENTLE * size * size);
        c.inverse = 1.0f / (p.edge * sqrt(fma(size, size, steep)) + 4 * depth_error(&p, c.q));
        for (int dy = PAIRS ? 0 : -REACH; !open && dy <= REACH; ++dy) {
            for (int dx = PAIRS && dy == 0 ? 1 : -REACH; dx <= REACH; ++dx) {
                if (dx == 0 && dy == 0)
                    continue;
                const nearV* const its = &around[dy + REACH][j + dx + REACH];
                offV apart = off_at(its, here, &split, &c, dx, dy);
#if PAIRS
                const nearV* const opposite = &around[REACH - dy][j - dx + REACH];
                const offV its_opposite = off_at(opposite, here, &split, &c, -dx, -dy);
                apart.off = max(apart.off, its_opposite.off);
                apart.off_second = max(apart.off_second, its_opposite.off_second);
#endif
                const floatV weight = weight_of(&c, apart.off, dx, dy);
                floatV values[SUMS];
                for (int i = 0; i < SUMS; ++i) {
                    values[i] = its->sums[i];
#if PAIRS
                    values[i] += opposite->sums[i];
#endif
                    sum[i] += select((floatV)0.0f, weight * values[i], weight > 0.0f);
                }
#if OUTPUT == 0
                const floatV more = weight_of(&c, apart.off_second, dx, dy) - weight;
                if (any_of(more > 0.0f)) {
                    for (int i = 0; i < SUMS; ++i)
                        second[i] += select((floatV)0.0f, more * values[i], more > 0.0f);
                }
#endif
            }
        }
        const intV known = c.q > 1.5f * NOTHING, surface = c.q > NOTHING;
#if OUTPUT == 2
        const floatV length = sqrt(fma(sum[0], sum[0], fma(sum[1], sum[1], sum[2] * sum[2])));
        for (int i = 0; i < 3; ++i) {
            const floatV unit = select((floatV)0.0f, sum[i] / length, surface & (length > 0.0f));
            dealt[i][j] = select((floatV)NAN, unit, known);
        }
#else
        floatV fraction = sum[0] / max(sum[1], 1e-30f);
#if OUTPUT == 0
        const floatV darker = (sum[0] + second[0]) / max(sum[1] + second[1], 1e-30f) - fraction;
        fraction += max(darker, c.lighter * darker);
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
