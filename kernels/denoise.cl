// Visibility, confidence or bent normals from the sums of every pixel's own slices, over the 16 sampling patterns around it.
//   visibility = 1 - sum_n w_n B_n / sum_n w_n G_n
// A 5 x 5 window whose outermost rows and columns count half holds every pattern equally often. A neighbour counts by how
// far it lies from the pixel's tangent plane, in planar depth, so that nothing is mixed across an edge.

#include "ray.h"
#include "split.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in an eye, 0 where they are parallel"
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

__kernel void denoise(__global const float* fronts, __global const float* slopes, __global const float* sums,
                      __global float* target, const grid_params grid, const split_params split,
                      const occlusion_params p) {
    const int column = (int)get_global_id(0) * V;
    const int y = (int)get_global_id(1) + (int)grid.reserved;
    if (column >= (int)split.columns)
        return;
    const int v = y + (int)(split.pixel_y & 3);
    const uint all = 16 * split.plane;

#if OUTPUT == 0
    const uint which[SUMS] = {0, all};
#elif OUTPUT == 1
    const uint which[SUMS] = {2 * all, all};
#else
    const uint which[SUMS] = {3 * all, 4 * all, 5 * all};
#endif

    floatV dealt[OUTPUT == 2 ? 3 : 1][4];
    for (int j = 0; j < 4; ++j) {
        const uint here = in_plane(&split, (v & 3) * 4 + j, column, v >> 2);
        const floatV q = LOAD(float, fronts + here);
        floatV sum[SUMS];
#if REACH
        const floatV right = LOAD(float, slopes + here), down = LOAD(float, slopes + all + here);
        // A pixel's width on the surface, as planar depth: what a face at 45 degrees would differ by.
        const floatV size = PERSPECTIVE ? fabs(q) * p.pixel : (floatV)p.pixel;
        const floatV error = depth_error(&p, q);
        const floatV steep = fma(right, right, down * down);
        const floatV inverse = 1.0f / (p.edge * sqrt(fma(size, size, steep)) + 4 * error);
        for (int i = 0; i < SUMS; ++i)
            sum[i] = 0.0f;
        for (int dy = -REACH; dy <= REACH; ++dy) {
            for (int dx = -REACH; dx <= REACH; ++dx) {
                const uint at = in_plane(&split, ((v + dy) & 3) * 4 + ((j + dx) & 3), column + ((j + dx) >> 2), (v + dy) >> 2);
                const floatV off = fabs(LOAD(float, fronts + at) - fma(right, (floatV)(float)dx, fma(down, (floatV)(float)dy, q)));
                const float share = (abs(dx) == REACH ? 0.5f : 1.0f) * (abs(dy) == REACH ? 0.5f : 1.0f);
                const floatV weight = share * max(fma(-off, inverse, (floatV)1.0f), 0.0f);
                intV counts = weight > 0.0f;
#if CLAMP
                const intV x = 4 * ((intV)column + LANE_INDEX(int)) + (j + dx - (int)(split.pixel_x & 3));
                counts &= (x >= 0) & (x < (int)split.width) & (intV)(y + dy >= 0 && y + dy < (int)split.height ? -1 : 0);
#endif
                for (int i = 0; i < SUMS; ++i)
                    sum[i] += select((floatV)0.0f, weight * LOAD(float, sums + which[i] + at), counts);
            }
        }
#else
        for (int i = 0; i < SUMS; ++i)
            sum[i] = LOAD(float, sums + which[i] + here);
#endif
        const intV known = q > 1.5f * NOTHING, surface = q > NOTHING;
#if OUTPUT == 2
        const floatV length = sqrt(fma(sum[0], sum[0], fma(sum[1], sum[1], sum[2] * sum[2])));
        for (int i = 0; i < 3; ++i) {
            const floatV unit = select((floatV)0.0f, sum[i] / length, surface & (length > 0.0f));
            dealt[i][j] = select((floatV)NAN, unit, known);
        }
#else
        const floatV share = sum[0] / max(sum[1], 1e-30f);
        const floatV result = min(max(OUTPUT == 0 ? 1.0f - share : share, 0.0f), 1.0f);
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
