// The sectors of a side of a slice: from tangent plane to view ray, 31 parts of the same cosine-weighted measure, a bit each.
//   G(t) = 1/2 [sin^2 t + nu (t - sin t cos t)],  nu = n.T / n.V,  t from the view ray to the tangent plane
// A side's term of Jimenez et al. 2016, eq. 7, is G cos gamma with nu = tan gamma. The projected normal's length in eq. 8
// makes that G n.V, the same n.V in all slices: it cancels where the blocked measure is divided by the whole one.
// Bits are those of Therrien et al. 2023, whose sectors have equal angles. One maximum a side, the horizon, would block what
// lies below a far column's chord of the sphere.
// Built for: BENT = 0 1

#ifndef FATHOM_SECTORS_H
#define FATHOM_SECTORS_H

#include "ssao/column.h"

#ifndef BENT
#error "BENT is not defined: 1 to sum the open directions, 0 otherwise"
#endif

#define SECTORS 31.0f

// asin c + c sqrt(1 - c^2) to 1.4e-3, exact at 0 and 1.
INLINE floatV lens(floatV c) {
    const floatV c2 = c * c;
    const floatV h = fma(c2, fma(c2, (floatV)-0.211485824f, (floatV)0.210784609f), (floatV)-0.439477174f);
    return c * fma(c2, h, (floatV)2.01097472f);
}

// 2 G from the view ray to the angle of cosine c: Jimenez et al. 2016, eq. 7, over 1/2 cos gamma.
INLINE floatV measure(floatV c, floatV nu) {
    return fma(-c, c, (floatV)1.0f) + nu * ((float)M_PI_2_F - lens(c));
}

// Where sectors begin on a side of a slice, and from where on the first may be blocked.
INLINE void set_sectors(sideV* side, floatV tangent, float rounding) {
    side->lowest = tangent * inverse_root(fma(tangent, tangent, (floatV)1.0f));
    side->nu = -tangent;
    side->whole = max(measure(side->lowest, side->nu), 1e-6f);
    const floatV per_sector = SECTORS * rough_inverse(side->whole);
    side->sectors_square = per_sector;
    side->sectors_nu = per_sector * side->nu;
    side->sectors_offset = SECTORS + rounding - per_sector * fma(side->nu, (floatV)M_PI_2_F, (floatV)1.0f);

    // A sector's measure is at most root(1 + nu^2) times the square of the angle above the tangent plane.
    const floatV square =
        side->whole * ((1.0f - rounding) / SECTORS) * rough_inverse_root(fma(tangent, tangent, (floatV)1.0f));
    const floatV above = square * rough_inverse_root(square);
    const floatV sky = fma(-tangent, above, (floatV)1.0f);
    const floatV first = fma(tangent + above, rough_inverse(sky), -side->offset) * rough_inverse(side->scale);
    side->first = select((floatV)INFINITY, first, sky > 0.0f);
}

// Sectors between the tangent plane and an angle, as a count. In the mean of the slices `rounding` is 1/2, so
// that a sector counts if half of it is covered, as in section 3.1 of Therrien et al. 2023.
INLINE intV sectors_to(floatV cotangent, const sideV* side) {
    const floatV c = max(cotangent * rough_inverse_root(fma(cotangent, cotangent, (floatV)1.0f)), side->lowest);
    return convert_intV(fma(c * c, side->sectors_square, fma(lens(c), side->sectors_nu, side->sectors_offset)));
}

// The sectors of a part: Therrien et al. 2023, algorithm 1, lines 18 and 19.
INLINE intV sectors_of(const sideV* side, const partV* part) {
    const intV from = max(sectors_to(fma(side->scale, part->bottom, side->offset), side), 0);
    const intV to = min(max(sectors_to(fma(side->scale, part->top, side->offset), side), from), (int)SECTORS);
    return ((intV)1 << to) - ((intV)1 << from);
}

// Neighbouring columns mostly block parts that overlap. One that lies apart sets the sectors of those before it.
INLINE intV join(const sideV* side, partV* parts, const partV* next) {
    const intV apart = (next->top >= next->bottom) & (parts->top >= parts->bottom) &
                       ((next->bottom > parts->top) | (next->top < parts->bottom));
    intV covered = 0;
    if (any_of(apart)) {
        const partV none = no_part();
        covered = select((intV)0, sectors_of(side, parts), apart);
        parts->bottom = select(parts->bottom, none.bottom, apart);
        parts->top = select(parts->top, none.top, apart);
    }
    parts->bottom = min(parts->bottom, next->bottom);
    parts->top = max(parts->top, next->top);
    return covered;
}

#if BENT
#define BENT_ANGLES 24 // cosine and sine of (i + 1/2) pi / 24
__constant float bent_angles[BENT_ANGLES][2] = {
    {0.997858923f, 0.065403129f},  {0.980785280f, 0.195090322f},  {0.946930129f, 0.321439465f},
    {0.896872742f, 0.442288690f},  {0.831469612f, 0.555570233f},  {0.751839807f, 0.659345815f},
    {0.659345815f, 0.751839807f},  {0.555570233f, 0.831469612f},  {0.442288690f, 0.896872742f},
    {0.321439465f, 0.946930129f},  {0.195090322f, 0.980785280f},  {0.065403129f, 0.997858923f},
    {-0.065403129f, 0.997858923f}, {-0.195090322f, 0.980785280f}, {-0.321439465f, 0.946930129f},
    {-0.442288690f, 0.896872742f}, {-0.555570233f, 0.831469612f}, {-0.659345815f, 0.751839807f},
    {-0.751839807f, 0.659345815f}, {-0.831469612f, 0.555570233f}, {-0.896872742f, 0.442288690f},
    {-0.946930129f, 0.321439465f}, {-0.980785280f, 0.195090322f}, {-0.997858923f, 0.065403129f},
};

// Adds the open directions of a side of a slice, weighted by the cosine.
INLINE void add_open(const sideV* side, const sliceV* slice, const pixelV* c, const occlusion_params* p, float sign,
                     intV found, floatV weight, floatV* bent) {
    floatV open_along = 0.0f, open_across = 0.0f;
    for (int i = 0; i < BENT_ANGLES; ++i) {
        const float cosine = bent_angles[i][0], sine = bent_angles[i][1];
        const floatV density = max(fma(side->nu, (floatV)sine, (floatV)cosine), 0.0f) * sine;
        const floatV turned = fma((floatV)(cosine * cosine), side->sectors_square,
                                  fma(lens((floatV)cosine), side->sectors_nu, side->sectors_offset));
        const intV bit = clamp(convert_intV(clamp(turned, 0.0f, SECTORS)), 0, 30);
        const floatV open = select(density, (floatV)0.0f, ((found >> bit) & 1) != 0);
        open_along = fma(open, (floatV)cosine, open_along);
        open_across = fma(open, (floatV)sine, open_across);
    }
    // Along the view ray, and along the slice's tangent: what of the step is across that.
    const floatV on_step = sign * open_across * slice->inverse_across * weight;
    const floatV on_ray = -c->inverse_length * fma(-on_step, slice->along, open_along * weight);
    for (int i = 0; i < 3; ++i)
        bent[i] += fma(on_ray, c->direction[i], on_step * fma(slice->x, p->step[i][0], slice->y * p->step[i][1]));
}
#endif

#endif
