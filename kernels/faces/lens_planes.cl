// Tangent planes of what a lens sees: m with 1/distance = m.u on the plane, u the unit ray, and the pixel's own 1/distance as a
// fourth number. Objects a pixel or two wide face the camera, as in ssao_planes.cl.
// Where a crease passes between a pixel and one of its four neighbours, the fourth number is negative, and its last bits say which
// neighbour it is and how the walls meet: see crease.h.
// Built for: LENS = 1; PERSPECTIVE = 1; GIVEN = 0 1; ALONG = 0 1 2

#include "faces/crease.h"
#include "normals/bent.h"
#include "ssao/wall.h"

#ifndef GIVEN
#error "GIVEN is not defined: 1 where the planes are those of given normals, 0 where they come from the depth"
#endif

#if !GIVEN
// The slope of a row or a column through the pixel whose inverse depth is `q`.
INLINE floatV slope_of(const floatV* nearby, floatV q, floatV step, floatV tolerance, floatV width) {
    return unless_thin(slope(nearby[0], nearby[1], q, nearby[2], nearby[3], tolerance), nearby, q, step, tolerance, width);
}

INLINE void row_of(const window* w, int dy, const bend* b, floatV* nearby) {
    for (int i = 0; i < 4; ++i) {
        const int dx = i < 2 ? i - 2 : i - 1;
        nearby[i] = fma((floatV)((float)(dx * dx * dx) / -6.0f), b->xxx, fma((floatV)(-0.5f * (float)(dx * dx)), b->xx, surface_only(neighbour(w, dx, dy))));
    }
}
INLINE void column_of(const window* w, int dx, const bend* b, floatV* nearby) {
    for (int i = 0; i < 4; ++i) {
        const int dy = i < 2 ? i - 2 : i - 1;
        nearby[i] = fma((floatV)((float)(dy * dy * dy) / -6.0f), b->yyy, fma((floatV)(-0.5f * (float)(dy * dy)), b->yy, surface_only(neighbour(w, dx, dy))));
    }
}
#endif

#if !GIVEN
#define MOST_BENT 4.0f // times the inverse distance and the square of a pixel's angle: what a plane may bend by
#define LEAST_CREASE 0.5f // widths of a pixel that the walls differ by from a pixel to the next

// A crease towards the neighbour `near`, behind which `far` lies: each wall's plane misses the other's pixel on the same side, or the
// pixel is on both.
INLINE void look_for_crease(floatV q, floatV step, floatV near, floatV far, intV folded, floatV least, int where, floatV* most, intV* code) {
    const floatV ahead = near - (q + step), back = q - fma((floatV)2.0f, near, -far);
    const floatV off = fabs(ahead);
    const intV same = ((ahead > 0.0f) & (back > 0.0f)) | ((ahead < 0.0f) & (back < 0.0f)) | folded;
    const intV found = same & (off > least) & (off > *most) & (off < INFINITY);
    *most = select(*most, off, found);
    *code = select(*code, select((intV)where, (intV)(where | CREASE_IS_HOLLOW), ahead > 0.0f), found);
}
#endif

INLINE void lens_plane(__global const float* depth, __global const float* normals, __global float* target,
                       const grid_params* grid, const lens_plane_params* p, const bent_ray* ray, uint x, uint y) {
    const window w = window_at(depth, grid, (int)x, (int)y);
    const floatV q = neighbour(&w, 0, 0);
    vectorV m;
#if GIVEN
    float lanes[3][V];
    for (int i = 0; i < V; ++i)
        for (int c = 0; c < 3; ++c)
            lanes[c][i] = normals[((size_t)y * p->stride + x + i) * p->given + c];
    m = (vectorV){*(const float_lanes*)lanes[0], *(const float_lanes*)lanes[1], *(const float_lanes*)lanes[2]};
    const floatV along = fma(m.x, ray->x.u, fma(m.y, ray->y.u, m.z * ray->z.u));
    m = scaled(m, q / along);
#else
    const floatV tolerance = 4.0f * error_through_lens(ray, fabs(q), p->error_quadratic, p->error_linear, p->error_constant);
    const floatV step = fma(q * q, (floatV)(THIN * p->radius), tolerance);
    const floatV wide = fma(ray->x.x, ray->x.x, fma(ray->y.x, ray->y.x, ray->z.x * ray->z.x));
    const floatV high = fma(ray->x.y, ray->x.y, fma(ray->y.y, ray->y.y, ray->z.y * ray->z.y));
    const floatV square = max(wide, high), width = q * sqrt(square);
    bend b = no_bend();
    floatV across[4], along[4];
    row_of(&w, 0, &b, across);
    column_of(&w, 0, &b, along);
    floatV right = slope_of(across, q, step, tolerance, width), down = slope_of(along, q, step, tolerance, width);
    // A difference of both sides cancels how a plane bends, and one of one side does not.
    const intV has_left = isfinite(across[1]), has_right = isfinite(across[2]), has_above = isfinite(along[1]),
               has_below = isfinite(along[2]);
    const intV bends = (q > 0.0f) & !(has_left & has_right & has_above & has_below);
    if (any_of(bends)) {
        // Without a neighbour in the row, the slope is that of a row beside it.
        const intV alone_in_row = !has_left & !has_right, alone_in_column = !has_above & !has_below;
        for (int pass = 0; pass < 2; ++pass) {
            for (int aside = -1; aside <= 1; aside += 2) {
                floatV beside[4];
                const floatV in_column = surface_only(neighbour(&w, 0, aside)), in_row = surface_only(neighbour(&w, aside, 0));
                row_of(&w, aside, &b, beside);
                const intV by_row = alone_in_row & isfinite(in_column) & (isfinite(beside[1]) | isfinite(beside[2]));
                right = select(right, slope_of(beside, in_column, step, tolerance, width), by_row);
                column_of(&w, aside, &b, beside);
                const intV by_column = alone_in_column & isfinite(in_row) & (isfinite(beside[1]) | isfinite(beside[2]));
                down = select(down, slope_of(beside, in_row, step, tolerance, width), by_column);
            }
            if (pass == 1)
                break;
            const bend all = bend_of(ray, q, right, down);
            // Only theirs: creases are looked for in the same values, whatever the vector's other pixels need.
            b.xx = select(b.xx, all.xx, bends), b.xxx = select(b.xxx, all.xxx, bends);
            b.yy = select(b.yy, all.yy, bends), b.yyy = select(b.yyy, all.yyy, bends);
            row_of(&w, 0, &b, across);
            column_of(&w, 0, &b, along);
            right = select(right, slope_of(across, q, step, tolerance, width), bends);
            down = select(down, slope_of(along, q, step, tolerance, width), bends);
        }
    }
    const floatV bent = fma(MOST_BENT * q, square, tolerance);
    const intV folded_across = has_crease(across, q, bent), folded_along = has_crease(along, q, bent);
    if (any_of(folded_across | folded_along)) {
        floatV corners[4];
        for (int i = 0; i < 4; ++i)
            corners[i] = surface_only(neighbour(&w, 2 * (i & 1) - 1, 2 * (i >> 1) - 1));
        take_wall(across, along, corners, q, bent, folded_across, folded_along, &right, &down);
    }
    m = plane_of(ray, q, right, down);
    const floatV least = fma((floatV)LEAST_CREASE, width, tolerance);
    floatV most = 0.0f;
    intV crease = -1;
    look_for_crease(q, right, across[2], across[3], folded_across, least, CREASE_RIGHT, &most, &crease);
    look_for_crease(q, -right, across[1], across[0], folded_across, least, CREASE_LEFT, &most, &crease);
    look_for_crease(q, down, along[2], along[3], folded_along, least, CREASE_BELOW, &most, &crease);
    look_for_crease(q, -down, along[1], along[0], folded_along, least, CREASE_ABOVE, &most, &crease);
#endif
    // Through the pixel itself, and not a few roundings beside it; without a plane straight across the ray.
    const floatV rest = q - fma(m.x, ray->x.u, fma(m.y, ray->y.u, m.z * ray->z.u));
    const intV is_plane = fabs(rest) <= 1e-3f * fabs(q);
    const floatV correction = select(q, rest, is_plane), none = (floatV)0.0f;
    m.x = fma(correction, ray->x.u, select(none, m.x, is_plane));
    m.y = fma(correction, ray->y.u, select(none, m.y, is_plane));
    m.z = fma(correction, ray->z.u, select(none, m.z, is_plane));
    float lanes_of[4][V];
    *(float_lanes*)lanes_of[0] = m.x;
    *(float_lanes*)lanes_of[1] = m.y;
    *(float_lanes*)lanes_of[2] = m.z;
#if GIVEN
    *(float_lanes*)lanes_of[3] = q;
#else
    *(float_lanes*)lanes_of[3] = select(q, with_crease(q, crease), (crease >= 0) & (q > 0.0f));
#endif
    __global float4* const to = (__global float4*)target + (size_t)y * p->stride + x;
    for (int i = 0; i < V; ++i)
        to[i] = (float4)(lanes_of[0][i], lanes_of[1][i], lanes_of[2][i], lanes_of[3][i]);
}

KERNEL void lens_planes(__global const float* depth, __global const float* normals, __global float* target,
                        const grid_params grid, const lens_plane_params p LENS_ARGUMENTS) {
    const uint rows = V == 1 ? 1 : lens_rows, begin = get_global_id(1) * rows;
    const uint x = first_column(grid.x_begin, grid.x_end), end = min(begin + rows, grid.height);
    if (x >= grid.x_end)
        return;
    bent_columns columns;
    for (uint y = begin; y < end; ++y) {
        const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
        if (y == begin || (py & (columns.rows.size - 1)) == 0)
            bent_columns_at(tiles, nodes, &lens, px, py, &columns);
        const bent_ray ray = bent_rays_of(&columns, py);
        lens_plane(depth, normals, target, &grid, &p, &ray, x, y);
    }
}
