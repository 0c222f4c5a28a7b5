// Visibility from the sums of every pixel's own slices, over the 16 sampling patterns around it.
//   visibility = 1 - sum_n w_n B_n / sum_n w_n G_n
// A 5 x 5 window whose outermost rows and columns count half holds every pattern equally often. A neighbour counts by how
// far it lies from the pixel's tangent plane, in planar depth, so that nothing is mixed across an edge.

#include "split.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in an eye, 0 where they are parallel"
#endif
#ifndef REACH
#error "REACH is not defined: pixels on either side that hold every pattern: 2 for 16 of them, 1 for 4, 0 for one"
#endif

__kernel void denoise(__global const float* fronts, __global const float* slopes, __global const float* sums,
                      __global float* target, const grid_params grid, const split_params split,
                      const occlusion_params p) {
    const int column = (int)get_global_id(0) * V;
    const int y = (int)get_global_id(1);
    if (column >= (int)split.columns)
        return;
    const int v = y + (int)(split.pixel_y & 3);
    const uint all = 16 * split.plane;

    floatV dealt[4];
    for (int j = 0; j < 4; ++j) {
        const uint here = in_plane(&split, (v & 3) * 4 + j, column, v >> 2);
        const floatV q = LOAD(float, fronts + here);
        floatV blocked, whole;
#if REACH
        const floatV right = LOAD(float, slopes + here), down = LOAD(float, slopes + all + here);
        // A pixel's width on the surface, as planar depth: what a face at 45 degrees would differ by.
        const floatV size = PERSPECTIVE ? fabs(q) * p.pixel : (floatV)p.pixel;
        const floatV error = fma(fabs(q), fma(fabs(q), (floatV)p.error_quadratic, (floatV)p.error_linear), (floatV)p.error_constant);
        const floatV steep = fma(right, right, down * down);
        const floatV inverse = 1.0f / (p.edge * sqrt(fma(size, size, steep)) + 4 * error);
        blocked = 0.0f, whole = 0.0f;
        for (int dy = -REACH; dy <= REACH; ++dy) {
            for (int dx = -REACH; dx <= REACH; ++dx) {
                const uint at = in_plane(&split, ((v + dy) & 3) * 4 + ((j + dx) & 3), column + ((j + dx) >> 2), (v + dy) >> 2);
                const floatV off = fabs(LOAD(float, fronts + at) - fma(right, (floatV)(float)dx, fma(down, (floatV)(float)dy, q)));
                const float share = (abs(dx) == REACH ? 0.5f : 1.0f) * (abs(dy) == REACH ? 0.5f : 1.0f);
                const floatV weight = share * max(fma(-off, inverse, (floatV)1.0f), 0.0f);
                const intV counts = weight > 0.0f;
                blocked += select((floatV)0.0f, weight * LOAD(float, sums + at), counts);
                whole += select((floatV)0.0f, weight * LOAD(float, sums + all + at), counts);
            }
        }
#else
        blocked = LOAD(float, sums + here), whole = LOAD(float, sums + all + here);
#endif
        const floatV visible = clamp(1.0f - blocked / max(whole, 1e-30f), 0.0f, 1.0f);
        dealt[j] = select(select((floatV)NAN, (floatV)1.0f, q > 1.5f * NOTHING), visible, q > NOTHING);
    }

    floatV row[4];
    RIFFLE(dealt, row);
    const int left = 4 * column - (int)(split.pixel_x & 3);
    __global float* to = target + grid.target_offset + (size_t)y * grid.target_stride;
    for (int j = 0; j < 4; ++j) {
        const int x = left + j * V;
        if (x >= 0 && x + V <= (int)split.width) {
            *(__global float_lanes*)(to + x) = row[j];
        } else {
            const float_lanes whole_row = row[j];
            const float* lanes = (const float*)&whole_row;
            for (int i = 0; i < V; ++i) {
                if (x + i >= 0 && x + i < (int)split.width)
                    to[x + i] = lanes[i];
            }
        }
    }
}
