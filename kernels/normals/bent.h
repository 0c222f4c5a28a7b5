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
    // With a branch for what is mostly 0, PoCL takes all columns through a row before the next one, in three times the time.
    const floatV error = fma((floatV)least, ray->ahead, (floatV)linear * size);
    return fma((floatV)quadratic * size, size / ray->ahead, error);
#else
    return fma(fma((floatV)quadratic, size, (floatV)linear), size, (floatV)least);
#endif
}

INLINE vectorV cross_of(floatV ax, floatV ay, floatV az, floatV bx, floatV by, floatV bz) {
    return (vectorV){fma(ay, bz, -az * by), fma(az, bx, -ax * bz), fma(ax, by, -ay * bx)};
}

INLINE vectorV scaled(vectorV a, floatV by) {
    return (vectorV){a.x * by, a.y * by, a.z * by};
}

// A component of the rays in the columns of V pixels, and its derivatives by pixels, as polynomials in t: all rows of a patch share
// them. Terms of the fifth order are left out of how it bends.
typedef struct {
    floatV u[4], x[4], y[3], xx[3], xy[3], yy[2], xxx, yyy;
} bent_column;

typedef struct {
    bent_column x, y, z;
    floatV ahead[4];
    patch_rows rows;
} bent_columns;

// Those of the pixels (x, y) to (x + V - 1, y) of the camera.
INLINE void bent_columns_at(__global const uint* tiles, __global const float* nodes, const lens_params* lens, uint x,
                            uint y, bent_columns* found) {
    const uintV columns = (uintV)x + LANE_INDEX(uint);
    found->rows.size = 1u << lens_tile_shift;
    patch_place at;
    for (uint next = x; next < x + V; next = at.start + at.size) { // mostly all lie in one patch
        at = place_in_patches(tiles, nodes, lens, next, y);
        const patch_polynomial p = polynomial_at(&at, next, y);
        const floatV s = convert_floatV(columns - at.start) * at.unit;
        const float unit = at.unit, unit2 = unit * unit, unit3 = unit2 * unit;
        const intV here = columns >= next;
        found->rows.size = min(found->rows.size, at.size);
#define BENT_SET(target, value) found->target = select(found->target, value, here)
#define BENT_COLUMN(c)                                                                                                 \
    do {                                                                                                               \
        floatV u[4], x[4];                                                                                             \
        for (int j = 0; j < 4; ++j) {                                                                                  \
            const floatV c2 = 2.0f * PATCH_FACTOR(2, j, c), c3 = 3.0f * PATCH_FACTOR(3, j, c);                         \
            u[j] = PATCH_FACTOR_CUBIC(j, c);                                                                           \
            x[j] = fma(s, fma(s, c3, c2), PATCH_FACTOR(1, j, c)) * unit;                                               \
            BENT_SET(c.x[j], x[j]);                                                                                    \
            if (j < 3)                                                                                                 \
                BENT_SET(c.xx[j], fma(s, 2.0f * c3, c2) * unit2);                                                      \
        }                                                                                                              \
        BENT_SET(c.u[0], (floatV)p.corner.c + u[0]);                                                                   \
        for (int j = 1; j < 4; ++j) {                                                                                  \
            BENT_SET(c.u[j], u[j]);                                                                                    \
            BENT_SET(c.y[j - 1], (float)j * unit * u[j]);                                                              \
            BENT_SET(c.xy[j - 1], (float)j * unit * x[j]);                                                             \
        }                                                                                                              \
        BENT_SET(c.yy[0], 2.0f * unit2 * u[2]);                                                                        \
        BENT_SET(c.yy[1], 6.0f * unit2 * u[3]);                                                                        \
        BENT_SET(c.yyy, 6.0f * unit3 * u[3]);                                                                          \
        BENT_SET(c.xxx, 6.0f * unit3 * PATCH_FACTOR(3, 0, c));                                                         \
    } while (0)
        BENT_COLUMN(x);
        BENT_COLUMN(y);
        BENT_COLUMN(z);
        BENT_SET(ahead[0], (floatV)p.corner.w + PATCH_FACTOR_CUBIC(0, w));
        for (int j = 1; j < 4; ++j)
            BENT_SET(ahead[j], PATCH_FACTOR_CUBIC(j, w));
        BENT_SET(rows.inside, (intV)((int)at.size - 1));
        BENT_SET(rows.unit, (floatV)unit);
#undef BENT_COLUMN
#undef BENT_SET
    }
}

INLINE bent_component component_at(const bent_column* c, floatV t) {
    return (bent_component){cubic_at(c->u, t),    cubic_at(c->x, t),   parabola_at(c->y, t), parabola_at(c->xx, t),
                            parabola_at(c->xy, t), line_at(c->yy, t), c->xxx,   c->yyy};
}

// The rays of row y of the camera. NaN where none is.
INLINE bent_ray bent_rays_of(const bent_columns* columns, uint y) {
    const floatV t = place_in_rows(&columns->rows, y);
    bent_ray ray = {component_at(&columns->x, t), component_at(&columns->y, t), component_at(&columns->z, t)};
    ray.ahead = cubic_at(columns->ahead, t);
    const bent_component a = ray.x, b = ray.y, c = ray.z;
    const vectorV across = cross_of(a.x, b.x, c.x, a.y, b.y, c.y);
    const floatV inverse = 1.0f / fma(a.u, across.x, fma(b.u, across.y, c.u * across.z));
    ray.dual = scaled(across, inverse);
    ray.dual_x = scaled(cross_of(a.y, b.y, c.y, a.u, b.u, c.u), inverse);
    ray.dual_y = scaled(cross_of(a.u, b.u, c.u, a.x, b.x, c.x), inverse);
    return ray;
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

// From the q of a plane without bends to that of one with them: within the column, and then i columns beside it.
INLINE floatV bent_in_column(floatV q, int j, const bend* b) {
    return fma((floatV)(0.5f * (float)(j * j)), b->yy, q);
}
INLINE floatV bent(floatV q, int i, int j, const bend* b) {
    return fma((floatV)(0.5f * (float)(i * i)), b->xx, fma((floatV)(float)(i * j), b->xy, q));
}
#endif

#endif
