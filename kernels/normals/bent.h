// How inverse depth bends on a plane that a lens sees, V pixels at a time.
//   q(x + i, y + j) = m u(x + i, y + j) = q + i gx + j gy + i^2/2 m uxx + i j m uxy + j^2/2 m uyy + i^3/6 m uxxx + j^3/6 m uyyy
// u is a patch, a polynomial, so its derivatives are exact up to how near the patch is to the ray. Where each pixel has a node of its
// own, second derivatives are differences of the nodes' slopes, and third ones are left out. Straight rays bend nothing.

#ifndef FATHOM_BENT_H
#define FATHOM_BENT_H

#include "camera/patch.h"
#include "camera/window.h"

typedef struct {
    floatV xx, xy, yy, xxx, yyy; // derivatives of q beyond its slopes
} bend;

INLINE bend no_bend(void) {
    const floatV none = (floatV)0.0f;
    return (bend){none, none, none, none, none};
}

#if !LENS
#define unbent_in_row(w, i, b) neighbour(w, i, 0)
#define unbent_in_column(w, j, b) neighbour(w, 0, j)
#define bent_in_column(q, j, b) (q)
#define bent(q, i, j, b) (q)
#else

typedef struct {
    floatV x, y, z;
} vectorV;

// A component of the ray, and its derivatives by pixels.
typedef struct {
    floatV u, x, y, xx, xy, yy, xxx, yyy;
} bent_component;

typedef struct {
    bent_component x, y, z;
    floatV ahead;                 // the part along the view axis
    vectorV dual, dual_x, dual_y; // of u, ux and uy
} bent_ray;

// Error of an inverse distance of this size: that of what is stored, which is 1/z where depth counts along the axis.
INLINE floatV error_through_lens(const bent_ray* ray, floatV size, float quadratic, float linear, float least) {
#if ALONG == ALONG_AXIS
    const floatV z_in_distances = ray->ahead, stored = size / z_in_distances;
#else
    const floatV z_in_distances = (floatV)1.0f, stored = size;
#endif
    return z_in_distances * fma(fma((floatV)quadratic, stored, (floatV)linear), stored, (floatV)least);
}

INLINE vectorV cross_of(floatV ax, floatV ay, floatV az, floatV bx, floatV by, floatV bz) {
    return (vectorV){fma(ay, bz, -az * by), fma(az, bx, -ax * bz), fma(ax, by, -ay * bx)};
}

INLINE vectorV scaled(vectorV a, floatV by) {
    return (vectorV){a.x * by, a.y * by, a.z * by};
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

// A row of the patch, and its first, second and third derivatives by y.
typedef struct {
    patch_row row, by_y, by_yy, by_yyy;
} bent_rows;

// x: the first column of those that lie in it.
INLINE bent_rows bent_rows_at(const patch_place* at, uint x, uint y) {
    bent_rows rows;
    if (at->size == 1) {
        const uint inside = (1u << lens_tile_shift) - 1;
        const int to_right = lens_node_floats / 4, down = to_right << lens_tile_shift;
        const float4 none = (float4)(0.0f);
        rows.row = (patch_row){at->node[0], at->node[1], at->node[2],
                               0.5f * bend_of_nodes(at->node, to_right, x & inside, 2), none};
        rows.by_y = (patch_row){none, at->node[3], at->node[4], none, none};
        rows.by_yy = (patch_row){none, bend_of_nodes(at->node, down, y & inside, 3), none, none, none};
        rows.by_yyy = (patch_row){none, none, none, none, none};
    } else {
        rows.row = row_of_patch(at->node, at->below, patch_factors(at->t), 1.0f);
        rows.by_y = row_of_patch(at->node, at->below, patch_factor_slopes(at->t), 0.0f);
        rows.by_yy = row_of_patch(at->node, at->below, patch_factor_bends(at->t), 0.0f);
        rows.by_yyy = row_of_patch(at->node, at->below, PATCH_FACTOR_TWISTS, 0.0f);
    }
    return rows;
}

#define BENT_SLOPE(row, i) fma(s, fma(s, (floatV)(3.0f * row.c3.i), (floatV)(2.0f * row.c2.i)), (floatV)row.c1.i)
#define BENT_COMPONENT(target, i)                                                                                      \
    BENT_SET(target.u, (floatV)rows.row.corner.i + PATCH_CUBIC(rows.row, i, s));                                       \
    BENT_SET(target.x, BENT_SLOPE(rows.row, i) * unit);                                                                \
    BENT_SET(target.xx, fma(s, (floatV)(6.0f * rows.row.c3.i), (floatV)(2.0f * rows.row.c2.i)) * unit2);               \
    BENT_SET(target.xxx, (floatV)(6.0f * rows.row.c3.i * unit3));                                                      \
    BENT_SET(target.y, PATCH_CUBIC(rows.by_y, i, s) * unit);                                                           \
    BENT_SET(target.xy, BENT_SLOPE(rows.by_y, i) * unit2);                                                             \
    BENT_SET(target.yy, PATCH_CUBIC(rows.by_yy, i, s) * unit2);                                                        \
    BENT_SET(target.yyy, PATCH_CUBIC(rows.by_yyy, i, s) * unit3)
#define BENT_RAY                                                                                                       \
    BENT_COMPONENT(ray->x, x);                                                                                         \
    BENT_COMPONENT(ray->y, y);                                                                                         \
    BENT_COMPONENT(ray->z, z);                                                                                         \
    BENT_SET(ray->ahead, (floatV)rows.row.corner.w + PATCH_CUBIC(rows.row, w, s))

// The rays of the pixels (x, y) to (x + V - 1, y) of the camera. NaN where none is.
INLINE void bent_rays(__global const uint* tiles, __global const float* nodes, const lens_params* lens, uint x, uint y,
                      bent_ray* ray) {
    const uintV columns = (uintV)x + LANE_INDEX(uint);
    patch_place at = place_in_patches(tiles, nodes, lens, x, y);
    bent_rows rows = bent_rows_at(&at, x, y);
    floatV s = convert_floatV(columns - at.start) * at.unit;
    float unit = at.unit, unit2 = unit * unit, unit3 = unit2 * unit;
#define BENT_SET(target, value) target = value
    BENT_RAY;
#undef BENT_SET
    for (uint next = at.start + at.size; next < x + V; next = at.start + at.size) { // mostly all lie in one patch
        at = place_in_patches(tiles, nodes, lens, next, y);
        rows = bent_rows_at(&at, next, y);
        s = convert_floatV(columns - at.start) * at.unit;
        unit = at.unit, unit2 = unit * unit, unit3 = unit2 * unit;
        const intV here = columns >= next;
#define BENT_SET(target, value) target = select(target, value, here)
        BENT_RAY;
#undef BENT_SET
    }
#undef BENT_RAY
#undef BENT_COMPONENT
#undef BENT_SLOPE
    const bent_component a = ray->x, b = ray->y, c = ray->z;
    const vectorV across = cross_of(a.x, b.x, c.x, a.y, b.y, c.y);
    const floatV inverse = 1.0f / fma(a.u, across.x, fma(b.u, across.y, c.u * across.z));
    ray->dual = scaled(across, inverse);
    ray->dual_x = scaled(cross_of(a.y, b.y, c.y, a.u, b.u, c.u), inverse);
    ray->dual_y = scaled(cross_of(a.u, b.u, c.u, a.x, b.x, c.x), inverse);
}

// m, of which q is m u, from q and its slopes.
INLINE vectorV plane_of(const bent_ray* ray, floatV q, floatV gx, floatV gy) {
#define BENT_SUM(i) fma(gy, ray->dual_y.i, fma(gx, ray->dual_x.i, q * ray->dual.i))
    return (vectorV){BENT_SUM(x), BENT_SUM(y), BENT_SUM(z)};
#undef BENT_SUM
}

INLINE bend bend_of(const bent_ray* ray, floatV q, floatV gx, floatV gy) {
    const vectorV m = plane_of(ray, q, gx, gy);
#define BENT_SUM(i) fma(m.z, ray->z.i, fma(m.y, ray->y.i, m.x * ray->x.i))
    return (bend){BENT_SUM(xx), BENT_SUM(xy), BENT_SUM(yy), BENT_SUM(xxx), BENT_SUM(yyy)};
#undef BENT_SUM
}

// What q of a neighbour would be if nothing bent.
INLINE floatV unbent_in_row(const window* w, int i, const bend* b) {
    const float half_square = 0.5f * (float)(i * i), cube = (float)(i * i * i) / 6.0f;
    return fma((floatV)-cube, b->xxx, fma((floatV)-half_square, b->xx, neighbour(w, i, 0)));
}
INLINE floatV unbent_in_column(const window* w, int j, const bend* b) {
    const float half_square = 0.5f * (float)(j * j), cube = (float)(j * j * j) / 6.0f;
    return fma((floatV)-cube, b->yyy, fma((floatV)-half_square, b->yy, neighbour(w, 0, j)));
}

// From the q of a plane without bends to that of one with them: within the column, and then i columns beside it.
INLINE floatV bent_in_column(floatV q, int j, const bend* b) {
    return fma((floatV)(0.5f * (float)(j * j)), b->yy, q);
}
INLINE floatV bent(floatV q, int i, int j, const bend* b) {
    return fma((floatV)(0.5f * (float)(i * i)), b->xx, fma((floatV)(float)(i * j), b->xy, q));
}
#endif

#endif
