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

// A row of the patch whose first corner this is, `below` the corner below. `b`: Hermite's four factors of the row, or their
// derivatives, which are exact, since t has few bits; the first is that of the rest. `whole`: 1 for the row itself, and 0 for its
// derivatives, from which the corner is gone.
INLINE patch_row row_of_patch(__global const float4* node, __global const float4* below, float4 b, float whole) {
    const int to_right = lens_node_floats / 4;
    __global const float4* const right = node + to_right;
    __global const float4* const opposite = below + to_right;
    const float4 b0 = (float4)(b.x), b1 = (float4)(b.y), b2 = (float4)(b.z), b3 = (float4)(b.w);

    patch_row row;
    row.corner = node[0];
    const float4 left_side = (below[0] - node[0]) + (below[1] - node[1]);
    const float4 right_side = (opposite[0] - right[0]) + (opposite[1] - right[1]);
    row.c0 = fma(b3, below[3], fma(b2, node[3], fma(b1, left_side, whole * node[1])));
    const float4 from_corner = whole * ((right[0] - node[0]) + right[1]);
    const float4 end = fma(b3, opposite[3], fma(b2, right[3], fma(b1, right_side, from_corner)));
    const float4 rise = end - row.c0;
    row.c1 = fma(b3, below[4], fma(b2, node[4], fma(b1, below[2], b0 * node[2])));
    const float4 end_slope = fma(b3, opposite[4], fma(b2, right[4], fma(b1, opposite[2], b0 * right[2])));
    row.c2 = 3.0f * rise - 2.0f * row.c1 - end_slope;
    row.c3 = row.c1 + end_slope - 2.0f * rise;
    return row;
}

// Hermite's four at t, and their first, second and third derivatives.
INLINE float4 patch_factors(float t) {
    const float b1 = t * t * (3.0f - 2.0f * t);
    return (float4)(1.0f - b1, b1, t * (1.0f - t) * (1.0f - t), -t * t * (1.0f - t));
}
INLINE float4 patch_factor_slopes(float t) {
    const float b1 = 6.0f * t * (1.0f - t);
    return (float4)(-b1, b1, (1.0f - t) * (1.0f - 3.0f * t), t * (3.0f * t - 2.0f));
}
INLINE float4 patch_factor_bends(float t) {
    return (float4)(12.0f * t - 6.0f, 6.0f - 12.0f * t, 6.0f * t - 4.0f, 6.0f * t - 2.0f);
}
#define PATCH_FACTOR_TWISTS (float4)(12.0f, -12.0f, 6.0f, 6.0f)

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
        return row_of_patch(at->node, at->below, patch_factors(at->t), 1.0f);
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

#endif
