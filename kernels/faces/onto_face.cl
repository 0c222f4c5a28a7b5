// A lens's image onto a pinhole's: each pixel takes the tangent plane of the pixel of the lens that it looks at, and its inverse
// depth there, with its slopes. So planes stay planes, and nothing is mixed across edges.
// Built for: ONTO = 0 1 2 3

#include "faces/face.h"
#include "ssao/split.h"

#ifndef ONTO
#error "ONTO is not defined: 0 inverse depth, 1 a number of each pixel, 2 a second layer's inverse depth, 3 a direction"
#endif

// The pixels of the depth that are seen at these positions of the camera's image: their numbers, or -1.
INLINE intV seen_at(floatV x, floatV y, const face_params* p) {
    const floatV border = (floatV)(1.0f / 64.0f); // what roundings may lie beyond the last pixel
    const floatV right = (floatV)(float)p->camera_columns;
    intV inside = (y >= -border) & (y < (float)p->camera_rows + border);
    intV column = convert_intV(floor(clamp(x, (floatV)-1e8f, (floatV)1e8f)));
    const intV row = clamp(convert_intV(floor(clamp(y, (floatV)-1e8f, (floatV)1e8f))), (intV)0, (intV)((int)p->camera_rows - 1));
    if (p->turn > 0) {
        inside &= fabs(x) < 1e8f;
        column += select((intV)0, (intV)(int)p->turn, column < 0);
        column -= select((intV)0, (intV)(int)p->turn, column >= (int)p->turn);
    } else {
        inside &= (x >= -border) & (x < right + border);
        column = clamp(column, (intV)0, (intV)((int)p->camera_columns - 1));
    }
    column -= (intV)(int)p->left;
    const intV in_row = row - (intV)(int)p->top;
    inside &= (column >= 0) & (in_row >= 0) & (column < (int)p->width) & (in_row < (int)p->height);
    return select((intV)-1, in_row * (int)p->plane_stride + column, inside);
}

// Between the nodes of a tile: from left to right, then down.
#define BETWEEN(here, to_right, below, opposite, s, t)                                                                 \
    fma(t, fma(s, opposite - below, below) - fma(s, to_right - here, here), fma(s, to_right - here, here))

// The pixels of the depth that pixels x to x + V - 1 of row y of the part see: their numbers, or -1.
INLINE intV seen_from(__global const uint* tiles, __global const float* nodes, const face_params* p, uint x, uint y) {
    const uint last = 15, tile = tiles[(y >> 4) * p->tiles + (x >> 4)];
    const uint shift = tile & 7, stride = shift == 0 ? 16 : (16u >> shift) + 1;
    __global const float2* const row = (__global const float2*)nodes + (tile >> 3) + ((y & last) >> shift) * stride;
    const uint inside = x & last, mask = (1u << shift) - 1;
    const float unit = as_float((127 - shift) << 23), t = (float)(y & mask) * unit;
    if ((1u << shift) >= V && shift > 0) { // all in one cell
        __global const float2* const node = row + (inside >> shift);
        const floatV s = convert_floatV((uintV)(inside & mask) + LANE_INDEX(uint)) * unit;
        const float2 here = node[0], to_right = node[1], below = node[stride], opposite = node[stride + 1];
        return seen_at(BETWEEN((floatV)here.x, (floatV)to_right.x, (floatV)below.x, (floatV)opposite.x, s, (floatV)t),
                       BETWEEN((floatV)here.y, (floatV)to_right.y, (floatV)below.y, (floatV)opposite.y, s, (floatV)t), p);
    }
    float places[2][V];
    for (uint i = 0; i < V; ++i) {
        __global const float2* const node = row + ((inside + i) >> shift);
        float2 at = node[0];
        if (shift > 0) {
            const float2 s = (float2)((float)((inside + i) & mask) * unit);
            at = BETWEEN(at, node[1], node[stride], node[stride + 1], s, (float2)(t));
        }
        places[0][i] = at.x;
        places[1][i] = at.y;
    }
    return seen_at(*(const float_lanes*)places[0], *(const float_lanes*)places[1], p);
}

// What pixels x to x + V - 1 of row y of the part see.
INLINE void onto_target(intV seen, __global const float* planes, __global const float* given, __global float* to,
                        __global float* slopes, const face_params* p, const onto_face_params* onto, uint x, uint y) {
#if ONTO != 0
    const int_lanes numbers = seen;
    const int* const at = (const int*)&numbers;
#endif
#if ONTO == 0 || ONTO == 2
    const face_planeV plane = planes_at(planes, max(seen, (intV)0), p);
    const floatV column = convert_floatV((intV)(int)x + LANE_INDEX(int)) + p->first[0], here = (float)y + p->first[1];
    floatV q = on_face(p, &plane, column, here), right = plane.right, down = plane.down;
    const intV creased = (seen >= 0) & (plane.crease < 0.0f);
    if (any_of(creased)) { // what the pixel's wall hides, or does not reach, belongs to the one behind the crease
        const intV beyond = select((intV)0, seen + step_over_crease(plane.crease, (int)p->plane_stride), creased);
        const face_planeV wall = planes_at(planes, beyond, p);
        const floatV other = plane_at(&wall, column, here);
        const floatV most = fabs(wall.right - plane.right) + fabs(wall.down - plane.down); // a pixel from the crease
        const floatV seen_there = select(min(q, other), max(q, other), is_hollow(plane.crease));
        const intV is_there = creased & (fabs(other - q) <= most) & (seen_there == other);
        q = select(q, seen_there, is_there);
        right = select(right, wall.right, is_there);
        down = select(down, wall.down, is_there);
    }
    q = select((floatV)NAN, q, seen >= 0);
#endif
#if ONTO == 2
    float other[V];
    for (int i = 0; i < V; ++i)
        other[i] = at[i] < 0 ? NAN : given[onto->offset + (size_t)(at[i] / (int)p->plane_stride) * onto->stride + at[i] % (int)p->plane_stride];
    const floatV part = *(const float_lanes*)other / plane.q; // what has a crease is known to a few roundings
    q *= select(part, (floatV)1.0f, fabs(part - 1.0f) < 2e-6f);
#endif
#if ONTO == 0
    store_float(packed_slopes(right, down), slopes + x);
#endif
#if ONTO == 0 || ONTO == 2
    store_float(q, to + x);
#else
    for (int i = 0; i < V; ++i) {
        const size_t from = at[i] < 0 ? 0
                                      : onto->offset + (size_t)(at[i] / (int)p->plane_stride) * onto->stride +
                                            (size_t)(at[i] % (int)p->plane_stride) * onto->channels;
#if ONTO == 1
        to[x + i] = at[i] < 0 ? 0.0f : given[from];
#else
        for (int c = 0; c < 3; ++c)
            to[3 * (x + i) + c] = at[i] < 0
                                      ? 0.0f
                                      : fma(onto->turn[c][0], given[from],
                                            fma(onto->turn[c][1], given[from + 1], onto->turn[c][2] * given[from + 2]));
#endif
    }
#endif
}

// Vectors of a work-item. Their planes lie along a curve, which no processor foresees, so it asks for all of them first.
#define VECTORS (V == 1 ? 1 : onto_face_columns / V)

KERNEL void onto_face(__global const uint* tiles, __global const float* nodes, __global const float* planes,
                      __global const float* given, __global float* target, __global float* slopes, const face_params p,
                      const onto_face_params onto) {
    const uint x = (uint)get_global_id(0) * (V * VECTORS), row = (uint)get_global_id(1), y = row - onto.margin;
    if (x >= p.columns)
        return;
    const long row_of = onto.target_offset + (long)(int)y * (long)p.stride;
    __global float* const to = target + row_of;
#if ONTO == 0
    // The margin around inverse depth, as inverse_depth.cl has it.
    if (onto.margin > 0) {
        const uint last = min(x + V * VECTORS, p.columns);
        if (x == 0)
            for (uint i = 1; i <= depth_margin_columns; ++i)
                to[-(int)i] = NAN;
        if (last == p.columns)
            for (uint i = last; i + depth_margin_columns < p.stride; ++i)
                to[i] = NAN;
        if (y >= p.rows) {
            for (uint i = x; i < last; i += V)
                store_float((floatV)NAN, to + i);
            return;
        }
    }
#endif
    intV seen[VECTORS];
    for (uint i = 0; i < VECTORS && x + i * V < p.columns; ++i) {
        seen[i] = seen_from(tiles, nodes, &p, x + i * V, y);
#if V > 1 && CLANG_BUILTINS
        const int_lanes numbers = seen[i];
        for (int j = 0; j < V; ++j)
            PREFETCH(planes + 4 * (size_t)max(((const int*)&numbers)[j], 0));
#endif
    }
    for (uint i = 0; i < VECTORS && x + i * V < p.columns; ++i)
        onto_target(seen[i], planes, given, to, slopes + row_of, &p, &onto, x + i * V, y);
}
