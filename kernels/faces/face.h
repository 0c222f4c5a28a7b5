// A pinhole's pixels on the tangent planes of a lens's image.

#ifndef FATHOM_FACE_H
#define FATHOM_FACE_H

#include "faces/crease.h"
#include "vector.h"

// Of the inverse distance that a plane may change by from its pixel to where a face looks: what changes more is no plane.
#define MOST_CHANGE 0.25f

// A tangent plane on a face: its inverse depth on the axis, and what a pixel to the right and one down add. And the inverse
// distance of the pixel that it belongs to, without and with what crease.h says of it.
typedef struct {
    floatV on_axis, right, down, q, crease;
} face_planeV;

INLINE face_planeV face_plane(const face_params* p, floatV x, floatV y, floatV z, floatV q) {
#define FACE_PART(of) fma(x, (floatV)of[0], fma(y, (floatV)of[1], z * of[2]))
    return (face_planeV){FACE_PART(p->ahead), FACE_PART(p->right), FACE_PART(p->down), fabs(q), q};
#undef FACE_PART
}

// PLANE(i) is the plane of the vector's i-th pixel.
#if V == 1
#define RETURN_PLANES(PLANE)                                                                                           \
    const float4 plane = PLANE(0);                                                                                     \
    return face_plane(p, plane.x, plane.y, plane.z, plane.w)
#else
#define RETURN_PLANES(PLANE)                                                                                           \
    float4 x[V / 4], y[V / 4], z[V / 4], q[V / 4];                                                                     \
    for (int i = 0; i < V; i += 4) {                                                                                   \
        const float16 four = (float16)(PLANE(i), PLANE(i + 1), PLANE(i + 2), PLANE(i + 3));                            \
        x[i / 4] = four.s048c;                                                                                         \
        y[i / 4] = four.s159d;                                                                                         \
        z[i / 4] = four.s26ae;                                                                                         \
        q[i / 4] = four.s37bf;                                                                                         \
    }                                                                                                                  \
    return face_plane(p, *(const float_lanes*)x, *(const float_lanes*)y, *(const float_lanes*)z, *(const float_lanes*)q)
#endif

// The planes of these pixels: their numbers, none of which is negative.
INLINE face_planeV planes_at(__global const float* planes, intV pixels, const face_params* p) {
    const int_lanes numbers = pixels;
    const int* const at = (const int*)&numbers;
#define PLANE_AT(i) *((__global const float4*)planes + at[i])
    RETURN_PLANES(PLANE_AT);
#undef PLANE_AT
}

// Those of neighbours in a row, from this pixel on.
INLINE face_planeV planes_in_row(__global const float* planes, uint first, const face_params* p) {
    __global const float4* const from = (__global const float4*)planes + first;
#define PLANE_IN_ROW(i) from[i]
    RETURN_PLANES(PLANE_IN_ROW);
#undef PLANE_IN_ROW
}

// Inverse depth of the plane at (x, y), pixels from the axis.
INLINE floatV plane_at(const face_planeV* plane, floatV x, floatV y) {
    return fma(x, plane->right, fma(y, plane->down, plane->on_axis));
}

// The same, or that of the pixel's distance.
INLINE floatV on_face(const face_params* p, const face_planeV* plane, floatV x, floatV y) {
    const floatV found = plane_at(plane, x, y);
    const floatV aside = fma(x, x, y * y) * (p->pixel * p->pixel);
    const floatV own = plane->q * sqrt(1.0f + aside);
    return select(own, found, fabs(found - own) <= MOST_CHANGE * own);
}

#endif
