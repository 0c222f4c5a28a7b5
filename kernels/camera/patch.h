// Rays through a lens, V neighbouring pixels at a time: bicubic Hermite patches that the host has made (src/lens/patches.cpp).
//   u(s, t) = sum of b_i(s) b_j(t) (u, h u_x, h u_y, h^2 u_xy) of the four corners
// Products and sums alone, so that every device has the same bits. A ray is the sum of its first corner and of what is left, which
// is small and therefore exact to far less than a float's last place.
// Built for: ALONG_AXIS = 0 1

#ifndef FATHOM_PATCH_H
#define FATHOM_PATCH_H

#include "camera/camera.h"

#ifndef ALONG_AXIS
#error "ALONG_AXIS is not defined: 1 where a depth counts along the view axis, 0 where it does along the ray"
#endif

// x, y, z in the axes of the result, and the part along the view axis. NaN where no ray meets a pixel.
typedef struct {
    pairV x, y, z, ahead;
} patch_rayV;

// A cubic in s, and the corner that it counts from: four components.
typedef struct {
    float4 corner, c0, c1, c2, c3;
} patch_row;

// Row t of the patch whose first corner this is; `below` is the corner below.
INLINE patch_row row_of_patch(__global const float4* node, __global const float4* below, float t) {
    const int to_right = lens_node_floats / 4;
    __global const float4* const right = node + to_right;
    __global const float4* const opposite = below + to_right;
    const float4 b1 = (float4)(t * t * (3.0f - 2.0f * t)), b0 = 1.0f - b1; // exact, as all that follow: t has few bits
    const float4 b2 = (float4)(t * (1.0f - t) * (1.0f - t)), b3 = (float4)(-t * t * (1.0f - t));

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

// The rays of the pixels (x, y) to (x + V - 1, y) of the camera.
INLINE patch_rayV patch_rays(__global const uint* tiles, __global const float* nodes, const lens_params* lens, uint x,
                             uint y) {
    const uint last = (1u << lens_tile_shift) - 1;
    const uintV columns = (uintV)x + LANE_INDEX(uint);
    patch_rayV ray;
    for (uint begin = x; begin < x + V;) {
        const uint tile = tiles[(y >> lens_tile_shift) * lens->tiles + (begin >> lens_tile_shift)];
        const uint shift = tile & 7, size = 1u << shift, start = begin & ~(size - 1);
        const uint stride = shift == 0 ? last + 1 : ((last + 1) >> shift) + 1;
        const uint place = (tile >> 3) + ((y & last) >> shift) * stride + ((start & last) >> shift);
        __global const float4* const node = (__global const float4*)nodes + (size_t)place * (lens_node_floats / 4);
        const float unit = as_float((127 - shift) << 23); // 1 / size
        patch_row row;
        if (shift == 0) { // a node for each pixel, and nothing between them
            row.corner = node[0];
            row.c0 = node[1];
            row.c1 = row.c2 = row.c3 = (float4)(0.0f);
        } else {
            row = row_of_patch(node, node + stride * (lens_node_floats / 4), (float)(y & (size - 1)) * unit);
        }
        const floatV s = convert_floatV(columns - start) * unit;
        const intV here = (columns >= begin) & (columns < start + size);
#define PATCH_COMPONENT(target, i)                                                                                     \
    target.high = select(target.high, (floatV)row.corner.i, here);                                                     \
    target.low = select(target.low,                                                                                    \
                        fma(s, fma(s, fma(s, (floatV)row.c3.i, (floatV)row.c2.i), (floatV)row.c1.i), (floatV)row.c0.i), here)
        PATCH_COMPONENT(ray.x, x);
        PATCH_COMPONENT(ray.y, y);
        PATCH_COMPONENT(ray.z, z);
        PATCH_COMPONENT(ray.ahead, w);
#undef PATCH_COMPONENT
        begin = start + size;
    }
    ray.ahead = two_sum(ray.ahead.high, ray.ahead.low);
    return ray;
}

// The distance from the camera centre of a decoded depth, which counts along the axis or along the ray.
INLINE floatV patch_distance(floatV depth, const patch_rayV* ray, const lens_params* lens) {
#if ALONG_AXIS
    const floatV distance = quotient_pair((pairV){depth, (floatV)0.0f}, ray->ahead);
    return select((floatV)NAN, select(distance, depth, isinf(depth)), ray->ahead.high >= lens->least_ahead);
#else
    return select(depth, (floatV)NAN, isnan(ray->ahead.high));
#endif
}

#endif
