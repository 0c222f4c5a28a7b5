// Normals from inverse depth q, which is affine in the pixel on every plane.
//   perspective, P = O + D(x, y)/q:     n = gx Dy x D1 + gy D1 x Dx + (q - gx x - gy y) Dx x Dy
//   orthographic rays, P = O(x, y) - q D:   n = gx Oy x D  + gy D x Ox  + Ox x Oy
// gx, gy: the slopes of q per pixel; Dx, Dy, D1 (Ox, Oy) the columns of the rays that multiply x, y and 1. Pixels are counted
// from where the first two are across the third, so that nothing cancels. With positions instead, a normal would be a
// difference of numbers that share their leading digits; here only q is subtracted, and the plane is met exactly.
// Through a lens, P = u/q with u the unit ray:
//   n = -m,   q = m u,   m = q u* + gx ux* + gy uy*        u*, ux*, uy* the dual of u, du/dx, du/dy: u* u = 1, u* ux = 0 ...
// There a plane's q bends by m uxx, m uyy ..., which are taken off the neighbours; see bent.h.
// RADIUS 0: slopes as slope.h chooses them. Otherwise a plane is fitted to those pixels of the window that lie within the
// stored values' rounding, and within a few standard deviations of a sensor's noise, of it: first in a small window, whose
// slopes are good enough to tell the pixels of a wider one apart. Where all pixels of a window of radius 3 lie on their own plane,
// it is the result: lines through the windows' rows, which ROWS pixels below each other share, then give it at once.
// Built for: RADIUS = 0 3 5 8; ALONG = 0 1; ROWS = 1 8 16

#include "params.h"
#include "camera/patch.h"
#include "normals/slope.h"
#include "store.h"
#include "camera/window.h"
#include "normals/bent.h"
#include "normals/whole.h"

#if !defined(RADIUS) || RADIUS < 0 || RADIUS > 16
#error "RADIUS is not defined: 0 for slopes of the nearest neighbours, or how far the window reaches, up to the margin's columns"
#endif
#define SMALL_RADIUS WHOLE_RADIUS
#define BY_ROWS (RADIUS == WHOLE_RADIUS && !LENS)
#if !defined(ROWS) || ROWS < 1
#error "ROWS is not defined: the pixels below each other of a work-item, which pays for a RADIUS of 3 without a lens"
#endif

// What errors of one bound each make of the slope of five pixels in a row, sum |x| / sum x^2, and of that of seven.
#define GUESS_ERROR 0.6f
#define FIT_ERROR 0.43f

// How far a pixel of the same plane may lie off it, in standard deviations of the noise: so many at the centre, and so many
// more for each pixel of distance. The first plane, the GUESS, goes through the centre pixel, which has the same noise, and
// its slopes are off by 0.32 standard deviations a pixel. Those of the FIT to the small window are off by 0.07, and by 0.17
// beside an edge.
#define GUESS_NOISE 4.5f
#define GUESS_SLOPE_NOISE 0.5f
#define FIT_NOISE 4.0f
#define FIT_SLOPE_NOISE 0.1f
// How far a pixel may lie off the plane of its whole window, in bounds of its error: between what the fit takes at the centre, 2,
// and in a corner, 4.6. With more, bends of a few pixels count as rounding; with 2, terrain takes a quarter longer.
#define WHOLE_ERROR 2.4f

#if LENS
// What two neighbours on either side say along a row or a column, with the bend in it.
typedef struct {
    floatV before, after;         // rises from one pixel to the next
    floatV off_before, off_after; // by how much each side mispredicts the centre
    floatV both_sides, all_five;  // slopes of more pixels
} rises;

INLINE rises rises_of(floatV before2, floatV before1, floatV centre, floatV after1, floatV after2) {
    const floatV width = after1 - before1;
    return (rises){centre - before1,
                   after1 - centre,
                   fma((floatV)2.0f, before1, -before2) - centre,
                   fma((floatV)2.0f, after1, -after2) - centre,
                   0.5f * width,
                   0.1f * fma((floatV)2.0f, after2 - before2, width)};
}

// The slope of the side that predicts the centre better, or the mean of both where both do about as well: near enough to tell how a
// plane bends.
INLINE floatV rough_slope(const rises* r, bool all, floatV tolerance) {
    const floatV before = fabs(r->off_before), after = fabs(r->off_after);
    const intV first = before < after,
               both = max(before, after) <= fma((floatV)WORSE_SIDE, min(before, after), tolerance);
    if (all)
        return select(select(r->after, r->before, first), r->both_sides, both);
    const floatV one = select(r->after, r->before, first | !(fabs(r->after) < INFINITY));
    const floatV found = select(one, r->both_sides, both & (fabs(r->both_sides) < INFINITY));
    return select((floatV)0.0f, found, fabs(found) < INFINITY);
}

// The slope at the centre, of which `second` and `third` are the derivatives.
INLINE floatV slope_of_bent(const rises* r, floatV second, floatV third, bool all, floatV tolerance) {
    const floatV sixth = (1.0f / 6.0f) * third;
    const floatV before = r->before + fma((floatV)0.5f, second, -sixth),
                 after = r->after - fma((floatV)0.5f, second, sixth);
    floatV off_before = fabs(r->off_before + (second - third)), off_after = fabs(r->off_after + (second + third));
    if (!all) {
        off_before = best_misprediction(off_before, fabs(before));
        off_after = best_misprediction(off_after, fabs(after));
    }
    return slope_by(off_before, off_after, before, after, r->both_sides - sixth, fma((floatV)-3.4f, sixth, r->all_five),
                    tolerance);
}

// The plane of the nearest pixels, and how it bends.
INLINE void nearest_plane(const window* w, const bent_ray* ray, floatV error, bend* b, plane* p) {
    const floatV tolerance = 4.0f * error, q = neighbour(w, 0, 0);
    const rises row = rises_of(neighbour(w, -2, 0), neighbour(w, -1, 0), q, neighbour(w, 1, 0), neighbour(w, 2, 0));
    const rises column = rises_of(neighbour(w, 0, -2), neighbour(w, 0, -1), q, neighbour(w, 0, 1), neighbour(w, 0, 2));
    // Mostly all have all their neighbours, and then none needs to do with fewer.
    const floatV off =
        (fabs(row.off_before) + fabs(row.off_after)) + (fabs(column.off_before) + fabs(column.off_after));
    const bool all = !any_of(!(off < INFINITY));
    *b = bend_of(ray, q, rough_slope(&row, all, tolerance), rough_slope(&column, all, tolerance));
    p->q = q;
    p->gx = slope_of_bent(&row, b->xx, b->xxx, all, tolerance);
    p->gy = slope_of_bent(&column, b->yy, b->yyy, all, tolerance);
}
#else
INLINE void nearest_plane(const window* w, floatV error, plane* p) {
    const floatV tolerance = 4.0f * error, q = neighbour(w, 0, 0);
    p->q = q;
    p->gx = slope(neighbour(w, -2, 0), neighbour(w, -1, 0), q, neighbour(w, 1, 0), neighbour(w, 2, 0), tolerance);
    p->gy = slope(neighbour(w, 0, -2), neighbour(w, 0, -1), q, neighbour(w, 0, 1), neighbour(w, 0, 2), tolerance);
}
#endif

#if RADIUS > 0
// The plane of least squares through the pixels that `p` predicts to within `margin` + `per_pixel` times the distance.
// It is drawn towards `p` with the weight of one pixel, so that a pixel without any neighbour that fits keeps `p`.
// Rows from `first` to `last` are there to be read; those beyond are as empty as these two.
INLINE void refit(const window* w, const int radius, int first, int last, floatV margin, floatV per_pixel,
                  const bend* b, plane* p) {
    floatV n = (floatV)0.0f, sx = (floatV)0.0f, sy = (floatV)0.0f, sr = (floatV)0.0f;
    floatV sxx = (floatV)1.0f, sxy = (floatV)0.0f, syy = (floatV)1.0f, sxr = (floatV)0.0f, syr = (floatV)0.0f;
#pragma unroll
    for (int dy = -radius; dy <= radius; ++dy) {
        const int row = clamp(dy, first, last);
        const floatV middle = bent_in_column(fma(p->gy, (floatV)(float)dy, p->q), dy, b);
        const floatV limit = fma(per_pixel, (floatV)(float)abs(dy), margin);
        floatV row_n = (floatV)0.0f, row_x = (floatV)0.0f, row_xx = (floatV)0.0f, row_r = (floatV)0.0f;
#pragma unroll
        for (int dx = -radius; dx <= radius; ++dx) {
            const floatV rest = neighbour(w, dx, row) - bent(fma(p->gx, (floatV)(float)dx, middle), dx, dy, b);
            const intV fits = fabs(rest) <= fma(per_pixel, (floatV)(float)abs(dx), limit);
            const floatV one = select((floatV)0.0f, (floatV)1.0f, fits), r = select((floatV)0.0f, rest, fits);
            row_n += one;
            row_x = fma(one, (floatV)(float)dx, row_x);
            row_xx = fma(one, (floatV)(float)(dx * dx), row_xx);
            row_r += r;
            sxr = fma(r, (floatV)(float)dx, sxr);
        }
        n += row_n;
        sx += row_x;
        sxx += row_xx;
        sr += row_r;
        sy = fma(row_n, (floatV)(float)dy, sy);
        sxy = fma(row_x, (floatV)(float)dy, sxy);
        syy = fma(row_n, (floatV)(float)(dy * dy), syy);
        syr = fma(row_r, (floatV)(float)dy, syr);
    }
    // About the mean; all but the residuals' sums are small integers, so nothing is lost.
    const floatV each = 1.0f / max(n, (floatV)1.0f);
    const floatV mx = sx * each, my = sy * each, mr = sr * each;
    const floatV xx = fma(-mx, sx, sxx), xy = fma(-mx, sy, sxy), yy = fma(-my, sy, syy);
    const floatV xr = fma(-mx, sr, sxr), yr = fma(-my, sr, syr);
    const floatV inverse = 1.0f / fma(xx, yy, -xy * xy);
    const floatV cx = fma(yy, xr, -xy * yr) * inverse, cy = fma(xx, yr, -xy * xr) * inverse;
    p->q += mr - fma(cx, mx, cy * my);
    p->gx += cx;
    p->gy += cy;
}

// The plane of the window's pixels, from that of the nearest ones.
INLINE void fit(const window* w, const grid_params* grid, uint y, floatV deviation, floatV error, const bend* b,
                plane* p) {
    refit(w, SMALL_RADIUS, -SMALL_RADIUS, SMALL_RADIUS, fma((floatV)GUESS_NOISE, deviation, 2.0f * error),
          fma((floatV)GUESS_SLOPE_NOISE, deviation, GUESS_ERROR * error), b, p);
    const int first = RADIUS > depth_margin_rows ? -(int)y - depth_margin_rows : -RADIUS;
    const int last = RADIUS > depth_margin_rows ? (int)(grid->height - 1 - y) + depth_margin_rows : RADIUS;
    refit(w, RADIUS, first, last, fma((floatV)FIT_NOISE, deviation, 2.0f * error),
          fma((floatV)FIT_SLOPE_NOISE, deviation, FIT_ERROR * error), b, p);
}
#endif

#if !LENS
INLINE floatV component(const normal_params* p, int i, const plane* plane, floatV along) {
    const floatV of_slopes = fma((floatV)p->of_slope_x[i], plane->gx, (floatV)p->of_slope_y[i] * plane->gy);
    return fma((floatV)p->of_depth[i], along, of_slopes);
}
#endif

KERNEL void normals(__global const float* source, __global float* target, const grid_params grid,
                    const normal_params p LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end), begin = get_global_id(1) * ROWS;
    if (x >= grid.x_end || begin >= p.rows)
        return;
    const uint rows = ROWS == 1 ? 1 : min((uint)ROWS, p.rows - begin);
#if BY_ROWS
    line lines[ROWS + 2 * WHOLE_RADIUS];
    const window top = window_at(source, &grid, (int)x, (int)(grid.y_begin + begin) - WHOLE_RADIUS);
    for (uint i = 0; i < rows + 2 * WHOLE_RADIUS; ++i) {
        READ_AHEAD(top.here + i * top.stride);
        lines[i] = line_of_row(&top, (int)i);
    }
#endif
#if LENS
    bent_columns columns;
#endif
    for (uint i = 0; i < rows; ++i) {
        const uint made = begin + i, y = grid.y_begin + made;
        const window w = window_at(source, &grid, (int)x, (int)y);
#if !BY_ROWS
        READ_AHEAD(w.here + 2 * w.stride);
#endif
        const floatV q = neighbour(&w, 0, 0), size = fabs(q);
#if PERSPECTIVE
        const intV surface = (size > 0.0f) & (size < INFINITY);
#else
        const intV surface = size < INFINITY;
#endif
#if LENS
        if (i == 0 || ((grid.pixel_y + y) & (columns.rows.size - 1)) == 0)
            bent_columns_at(tiles, nodes, &lens, grid.pixel_x + x, grid.pixel_y + y, &columns);
        const bent_ray ray = bent_rays_of(&columns, grid.pixel_y + y);
        const floatV error = error_through_lens(&ray, size, p.error_quadratic, p.error_linear, p.error_constant);
#else
        const floatV error =
            fma(fma((floatV)p.error_quadratic, size, (floatV)p.error_linear), size, (floatV)p.error_constant);
#endif
        const floatV deviation = (floatV)p.noise * size;
        plane found;
#if LENS || RADIUS > 0
        bend b = no_bend();
#endif
#if BY_ROWS
        const intV whole = whole_plane(lines + i, fma((floatV)FIT_NOISE, deviation, WHOLE_ERROR * error), &found);
        if (any_of(surface & !whole)) {
            plane part;
            nearest_plane(&w, fma((floatV)2.0f, deviation, error), &part);
            fit(&w, &grid, y, deviation, error, &b, &part);
            found.q = select(part.q, found.q, whole);
            found.gx = select(part.gx, found.gx, whole);
            found.gy = select(part.gy, found.gy, whole);
        }
#else
#if LENS
        nearest_plane(&w, &ray, fma((floatV)2.0f, deviation, error), &b, &found);
#else
        nearest_plane(&w, fma((floatV)2.0f, deviation, error), &found);
#endif
#if RADIUS > 0
        fit(&w, &grid, y, deviation, error, &b, &found);
#endif
#endif

#if LENS
        const vectorV m = plane_of(&ray, found.q, found.gx, found.gy);
        const floatV nx = -m.x, ny = -m.y, nz = -m.z;
#else
#if PERSPECTIVE
        const floatV column = (vector_from(grid.pixel_x + x) - p.centre_x[0]) - p.centre_x[1];
        const float row = ((float)(grid.pixel_y + y) + 0.5f - p.centre_y[0]) - p.centre_y[1];
        const floatV along = fma(-found.gx, column, fma(-found.gy, (floatV)row, found.q));
#else
        const floatV along = (floatV)1.0f;
#endif
        const floatV nx = component(&p, 0, &found, along), ny = component(&p, 1, &found, along),
                     nz = component(&p, 2, &found, along);
#endif
        // The vector is brought into [1, 2) by a power of two, so that squares neither overflow nor vanish, and is made one
        // long. After a step of Newton on the guess only roundings are left.
        const floatV largest = max(max(fabs(nx), fabs(ny)), fabs(nz));
        const floatV scale = as_floatV(0x7f000000 - (as_intV(largest) & 0x7f800000));
        const floatV sx = nx * scale, sy = ny * scale, sz = nz * scale;
        const floatV square = fma(sx, sx, fma(sy, sy, sz * sz));
        const floatV guess = inverse_root_guess(square);
        const floatV rest = fma(-square * guess, guess, (floatV)1.0f);
        const floatV inverse = fma(0.5f * guess, rest, guess), none = (floatV)0.0f;
        store_vectors(select(none, sx * inverse, surface), select(none, sy * inverse, surface),
                      select(none, sz * inverse, surface), select(none, (floatV)1.0f, surface),
                      target + grid.target_offset + (size_t)made * grid.target_stride + (size_t)CHANNELS * x);
    }
}
