// Rays through a lens, V neighbouring pixels at a time: bicubic Hermite patches that the host has made (src/lens/patches.cpp).
//   u(s, t) = sum of b_i(s) b_j(t) (u, h u_x, h u_y, h^2 u_xy) of the four corners
// Products and sums alone, so that every device has the same bits. A ray is the sum of its first corner and of what is left, which
// is small and therefore exact to far less than a float's last place.
// Built for: LENS = 0 1

#ifndef FATHOM_PATCH_H
#define FATHOM_PATCH_H

#include "params.h"
#include "vector.h"

#ifndef LENS
#error "LENS is not defined: 1 where the camera has a lens, 0 where its rays are straight"
#endif

// What a kernel takes of a lens, behind all else, and what it hands on.
#if LENS
#define LENS_ARGUMENTS , __global const uint *tiles, __global const float *nodes, const lens_params lens
#define LENS_VALUES , tiles, nodes, &lens
#else
#define LENS_ARGUMENTS
#define LENS_VALUES
#endif

// x, y, z in the axes of the result, and the part along the view axis. NaN where no ray meets a pixel.
typedef struct {
    pairV x, y, z, ahead;
} patch_rayV;

// A cubic in s, and the corner that it counts from: four components.
typedef struct {
    float4 corner, c0, c1, c2, c3;
} patch_row;

// A row of the patch whose first corner this is, `below` the corner below. `b`: Hermite's four factors of the row, which are exact,
// since t has few bits; the first is that of the rest.
INLINE patch_row row_of_patch(__global const float4* node, __global const float4* below, float4 b) {
    const int to_right = lens_node_floats / 4;
    __global const float4* const right = node + to_right;
    __global const float4* const opposite = below + to_right;
    const float4 b0 = (float4)(b.x), b1 = (float4)(b.y), b2 = (float4)(b.z), b3 = (float4)(b.w);

    patch_row row;
    row.corner = node[0];
    const float4 left_side = (below[0] - node[0]) + (below[1] - node[1]);
    const float4 right_side = (opposite[0] - right[0]) + (opposite[1] - right[1]);
    row.c0 = fma(b3, below[3], fma(b2, node[3], fma(b1, left_side, node[1])));
    const float4 from_corner = (right[0] - node[0]) + right[1];
    const float4 end = fma(b3, opposite[3], fma(b2, right[3], fma(b1, right_side, from_corner)));
    const float4 rise = end - row.c0;
    row.c1 = fma(b3, below[4], fma(b2, node[4], fma(b1, below[2], b0 * node[2])));
    const float4 end_slope = fma(b3, opposite[4], fma(b2, right[4], fma(b1, opposite[2], b0 * right[2])));
    row.c2 = 3.0f * rise - 2.0f * row.c1 - end_slope;
    row.c3 = row.c1 + end_slope - 2.0f * rise;
    return row;
}

// Hermite's four at t.
INLINE float4 patch_factors(float t) {
    const float b1 = t * t * (3.0f - 2.0f * t);
    return (float4)(1.0f - b1, b1, t * (1.0f - t) * (1.0f - t), -t * t * (1.0f - t));
}

// The patch that pixel (x, y) of the camera lies in.
typedef struct {
    __global const float4*
        node; // its first corner; with a size of 1 the pixel's own node, and nothing lies between nodes
    __global const float4* below;
    uint start, size; // its first column, and its columns: a power of two
    float unit;       // 1 / size
    float t;          // where the row lies in it
} patch_place;

INLINE patch_place place_in_patches(__global const uint* tiles, __global const float* nodes, const lens_params* lens,
                                    uint x, uint y) {
    const uint last = (1u << lens_tile_shift) - 1;
    const uint tile = tiles[(y >> lens_tile_shift) * lens->tiles + (x >> lens_tile_shift)];
    const uint shift = tile & 7, size = 1u << shift, start = x & ~(size - 1);
    const uint stride = shift == 0 ? last + 1 : ((last + 1) >> shift) + 1;
    const uint place = (tile >> 3) + ((y & last) >> shift) * stride + ((start & last) >> shift);
    patch_place found;
    found.node = (__global const float4*)nodes + (size_t)place * (lens_node_floats / 4);
    found.below = found.node + stride * (lens_node_floats / 4);
    found.start = start;
    found.size = size;
    found.unit = as_float((127 - shift) << 23);
    found.t = (float)(y & (size - 1)) * found.unit;
    return found;
}

INLINE patch_row row_at(const patch_place* at) {
    if (at->size > 1)
        return row_of_patch(at->node, at->below, patch_factors(at->t));
    patch_row row;
    row.corner = at->node[0];
    row.c0 = at->node[1];
    row.c1 = row.c2 = row.c3 = (float4)(0.0f);
    return row;
}

#define PATCH_CUBIC(row, i, s)                                                                                         \
    fma(s, fma(s, fma(s, (floatV)row.c3.i, (floatV)row.c2.i), (floatV)row.c1.i), (floatV)row.c0.i)
#define PATCH_PAIR(row, i, s)                                                                                          \
    (pairV) {                                                                                                          \
        (floatV) row.corner.i, PATCH_CUBIC(row, i, s)                                                                  \
    }

// The rays of the pixels (x, y) to (x + V - 1, y) of the camera.
INLINE patch_rayV patch_rays(__global const uint* tiles, __global const float* nodes, const lens_params* lens, uint x,
                             uint y) {
    const uintV columns = (uintV)x + LANE_INDEX(uint);
    patch_place at = place_in_patches(tiles, nodes, lens, x, y);
    patch_row row = row_at(&at);
    floatV s = convert_floatV(columns - at.start) * at.unit;
    patch_rayV ray = {PATCH_PAIR(row, x, s), PATCH_PAIR(row, y, s), PATCH_PAIR(row, z, s), PATCH_PAIR(row, w, s)};
    for (uint next = at.start + at.size; next < x + V; next = at.start + at.size) { // mostly all lie in one patch
        at = place_in_patches(tiles, nodes, lens, next, y);
        row = row_at(&at);
        s = convert_floatV(columns - at.start) * at.unit;
        const intV here = columns >= next;
#define PATCH_COMPONENT(target, i)                                                                                     \
    target.high = select(target.high, (floatV)row.corner.i, here);                                                     \
    target.low = select(target.low, PATCH_CUBIC(row, i, s), here)
        PATCH_COMPONENT(ray.x, x);
        PATCH_COMPONENT(ray.y, y);
        PATCH_COMPONENT(ray.z, z);
        PATCH_COMPONENT(ray.ahead, w);
#undef PATCH_COMPONENT
    }
    ray.ahead = two_sum(ray.ahead.high, ray.ahead.low);
    return ray;
}

// Which of these pixels have rays: within a patch all have.
INLINE intV have_rays(__global const uint* tiles, __global const float* nodes, const lens_params* lens, uint x, uint y) {
    const uintV columns = (uintV)x + LANE_INDEX(uint);
    patch_place at = place_in_patches(tiles, nodes, lens, x, y);
    floatV corner = (floatV)at.node[0].x;
    for (uint next = at.start + at.size; next < x + V; next = at.start + at.size) {
        at = place_in_patches(tiles, nodes, lens, next, y);
        corner = select(corner, (floatV)at.node[0].x, columns >= next);
    }
    return corner == corner;
}

// The change of a slope from node to node, `slope` being its place in a node: by those on both sides that have rays.
INLINE float4 bend_of_nodes(__global const float4* node, int step, uint place, int slope) {
    const uint last = (1u << lens_tile_shift) - 1;
    const float4 none = (float4)(NAN), here = node[slope];
    const float4 before = place > 0 ? here - (node - step)[slope] : none;
    const float4 after = place < last ? (node + step)[slope] - here : none;
    if (isnan(before.x))
        return isnan(after.x) ? (float4)(0.0f) : after;
    return isnan(after.x) ? before : 0.5f * (before + after);
}

// A patch as a polynomial: its first corner, and the factors of s^i t^j of what is left.
typedef struct {
    float4 corner, factor[4][4];
} patch_polynomial;

// Of a cubic in t the factors, from its first value, its rise, and its slopes at both ends.
INLINE void cubic_of(float4 first, float4 rise, float4 slope, float4 end_slope, float4* factor) {
    factor[0] = first;
    factor[1] = slope;
    factor[2] = 3.0f * rise - 2.0f * slope - end_slope;
    factor[3] = slope + end_slope - 2.0f * rise;
}

// x, y: of the camera's pixel, where a node belongs to it alone.
INLINE patch_polynomial polynomial_at(const patch_place* at, uint x, uint y) {
    const int to_right = lens_node_floats / 4;
    __global const float4 *const node = at->node, *const below = at->below;
    patch_polynomial p;
    p.corner = node[0];
    if (at->size == 1) {
        const uint inside = (1u << lens_tile_shift) - 1;
        const int down = to_right << lens_tile_shift;
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                p.factor[i][j] = (float4)(0.0f);
        p.factor[0][0] = node[1];
        p.factor[1][0] = node[2];
        p.factor[0][1] = node[3];
        p.factor[1][1] = node[4];
        p.factor[2][0] = 0.5f * bend_of_nodes(node, to_right, x & inside, 2);
        p.factor[0][2] = 0.5f * bend_of_nodes(node, down, y & inside, 3);
        return p;
    }
    __global const float4 *const right = node + to_right, *const opposite = below + to_right;
    float4 end[4], end_slope[4]; // of the right side, the first one from the corner
    cubic_of(node[1], (below[0] - node[0]) + (below[1] - node[1]), node[3], below[3], p.factor[0]);
    cubic_of(node[2], below[2] - node[2], node[4], below[4], p.factor[1]);
    cubic_of((right[0] - node[0]) + right[1], (opposite[0] - right[0]) + (opposite[1] - right[1]), right[3], opposite[3],
             end);
    cubic_of(right[2], opposite[2] - right[2], right[4], opposite[4], end_slope);
    for (int j = 0; j < 4; ++j) {
        float4 across[4];
        cubic_of(p.factor[0][j], end[j] - p.factor[0][j], p.factor[1][j], end_slope[j], across);
        p.factor[2][j] = across[2];
        p.factor[3][j] = across[3];
    }
    return p;
}

// Where a row lies in those patches.
typedef struct {
    intV inside; // a row's bits that count within its patch
    floatV unit; // 1 / the patch's size
    uint size;   // of the smallest of the patches: so many rows, from a multiple of it, share the polynomials
} patch_rows;

INLINE floatV place_in_rows(const patch_rows* rows, uint y) {
    return convert_floatV((intV)(int)y & rows->inside) * rows->unit;
}

// Of the cubics in s of a polynomial's factors with t^j.
#define PATCH_FACTOR(i, j, c) (floatV)(p.factor[i][j].c)
#define PATCH_FACTOR_CUBIC(j, c)                                                                                       \
    fma(s, fma(s, fma(s, PATCH_FACTOR(3, j, c), PATCH_FACTOR(2, j, c)), PATCH_FACTOR(1, j, c)), PATCH_FACTOR(0, j, c))

INLINE floatV line_at(const floatV* factor, floatV t) {
    return fma(t, factor[1], factor[0]);
}
INLINE floatV parabola_at(const floatV* factor, floatV t) {
    return fma(t, line_at(factor + 1, t), factor[0]);
}
INLINE floatV cubic_at(const floatV* factor, floatV t) {
    return fma(t, parabola_at(factor + 1, t), factor[0]);
}

#endif
