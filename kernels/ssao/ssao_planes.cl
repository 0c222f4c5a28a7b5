// What the occlusion kernels read, from inverse depth: occluders and tangent planes, split into 4 x 4 planes.
//   front   inverse depth of the surface; behind everything where there is none
//   back    inverse depth of the end of what is assumed solid behind it
//   slopes  of the tangent plane on the screen, right and down, from neighbouring depths or from given normals. A vector whose
//           length is not 1, as a renderer's mean over an edge, and one that faces away are no normals: depth has the slope,
//           but for strands, where it has none and such a mean counts.
// Outside the image there is nothing, or the border's pixels again.
// Built for: THICKNESS = 0 1 2; GIVEN_NORMALS = 0 1 2 3; CLAMP = 0 1

#include "ssao/blocks.h"
#include "ssao/lattice.h"
#include "ssao/ray.h"
#include "ssao/split.h"
#include "ssao/wall.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in the camera centre, 0 where they are parallel (orthographic)"
#endif
#ifndef THICKNESS
#error "THICKNESS is not defined: 0 the same everywhere, 1 an image of it, 2 inverse depth of the back, and the same where there is none"
#endif
#ifndef GIVEN_NORMALS
#error                                                                                                                 \
    "GIVEN_NORMALS is not defined: 1 where normals come as an image, 2 where they were fitted to the depths, 3 where slopes do, 0 for none"
#endif
#ifndef CLAMP
#error "CLAMP is not defined: 1 to repeat the border outside the image, 0 for nothing there"
#endif

// A vector whose length differs from 1 by more is a mean over an edge, or no normal at all. Codes of 8 bits round less.
#define NO_NORMAL 0.02f
// The shortest mean that tells where a strand faces.
#define SHORTEST_MEAN 0.5f

// V neighbours of a row at (x, y); beyond it the border's pixels under CLAMP, `outside` otherwise.
INLINE floatV row_at(__global const float* image, const grid_params* grid, int x, int y, float outside) {
    const int width = (int)grid->x_end, height = (int)grid->height;
    if (y >= 0 && y < height && x >= 0 && x + V + EVERY - 1 <= width) {
        return load_every(image + grid->source_offset + (size_t)y * grid->source_stride + EVERY * x);
    }
    float lanes[V];
    for (int i = 0; i < V; ++i) {
        const int column = clamp(x + i, 0, width - 1), row = clamp(y, 0, height - 1);
        const bool inside = CLAMP || (column == x + i && row == y);
        lanes[i] = inside ? image[grid->source_offset + (size_t)row * grid->source_stride + EVERY * column] : outside;
    }
    return *(const float_lanes*)lanes;
}

#if GIVEN_NORMALS != 3
// Pixels of the image, also where the work-item's are every second one. The border does not repeat, so slopes are one-sided
// there.
INLINE floatV neighbours_at(__global const float* image, const grid_params* pixels, int x, int y) {
    return surface_only(pixels_at(image, pixels, x, y));
}

// The slope where the pixels next to this one are missing, as in every second row of a frame: from those beyond them.
INLINE floatV across_gaps(floatV found, const floatV* nearby, floatV q, floatV step) {
    const intV gap = !isfinite(nearby[1]) & !isfinite(nearby[2]);
    if (!any_of(gap))
        return found;
    const intV before = isfinite(nearby[0]), after = isfinite(nearby[3]);
    const floatV from_before = 0.5f * (q - nearby[0]), from_after = 0.5f * (nearby[3] - q);
    const floatV one_side = select(select((floatV)0.0f, from_after, after), from_before, before);
    const floatV wide = select(one_side, 0.5f * (from_before + from_after), before & after);
    const floatV off = select(one_side, from_before - from_after, before & after); // both sides agree on a plane
    return select(found, wide, gap & (fabs(off) < step));
}

#endif

#if GIVEN_NORMALS != 3
// The slopes from the depths around, and where they are those of no surface, as of a strand. Under `fitted` they are found
// already, and only what is thin or apart is mended.
INLINE void slopes_of_depth(__global const float* depth, const grid_params* grid, const grid_params* pixels,
                            const occlusion_params* p, int x, int y, floatV q, floatV fx, float fy, bool fitted,
                            floatV* right, floatV* down, intV* thin) {
    const floatV tolerance = 4.0f * depth_error(p, q);
    const int ix = EVERY * (x + (int)grid->pixel_x) - (int)pixels->pixel_x; // of the image
    const int iy = EVERY * (y + (int)grid->pixel_y) - (int)pixels->pixel_y;
    const floatV across[4] = {neighbours_at(depth, pixels, ix - 2, iy), neighbours_at(depth, pixels, ix - 1, iy),
                              neighbours_at(depth, pixels, ix + 1, iy), neighbours_at(depth, pixels, ix + 2, iy)};
    const floatV along[4] = {neighbours_at(depth, pixels, ix, iy - 2), neighbours_at(depth, pixels, ix, iy - 1),
                             neighbours_at(depth, pixels, ix, iy + 1), neighbours_at(depth, pixels, ix, iy + 2)};
    if (fitted) {
        *right *= 1.0f / EVERY, *down *= 1.0f / EVERY;
    } else {
        *right = slope(across[0], across[1], q, across[2], across[3], tolerance);
        *down = slope(along[0], along[1], q, along[2], along[3], tolerance);
        const intV folded_across = has_crease(across, q, tolerance), folded_along = has_crease(along, q, tolerance);
        if (any_of(folded_across | folded_along)) {
            const floatV corners[4] = {
                neighbours_at(depth, pixels, ix - 1, iy - 1), neighbours_at(depth, pixels, ix + 1, iy - 1),
                neighbours_at(depth, pixels, ix - 1, iy + 1), neighbours_at(depth, pixels, ix + 1, iy + 1)};
            take_wall(across, along, corners, q, tolerance, folded_across, folded_along, right, down);
        }
    }
    const floatV step = fma((PERSPECTIVE ? q * q : (floatV)1.0f) / ray_length(p, fx, fy),
                            (floatV)(THIN * p->radius), tolerance);
    const floatV size = (PERSPECTIVE ? fabs(q) : (floatV)1.0f) * (p->pixel / EVERY);
    const floatV found_right = across_gaps(*right, across, q, step), found_down = across_gaps(*down, along, q, step);
    *right = EVERY * unless_thin(found_right, across, q, step, tolerance, size);
    *down = EVERY * unless_thin(found_down, along, q, step, tolerance, size);
    *thin = (*right != EVERY * found_right) | (*down != EVERY * found_down);
}
#endif

#if GIVEN_NORMALS == 1 || GIVEN_NORMALS == 2
// The tangent plane n.(P - P_c) = 0 on the screen: q's slope is q (n.step) / (n.direction), with q = 1 in the first
// factor for an orthographic camera. Gives where the vectors are normals of a surface that faces the camera, or lie
// outside the image, where planes lie across the view; `mean`: or where they are a mean of such.
INLINE intV slopes_of(__global const float* normals, const source_params* source, const split_params* split,
                      const occlusion_params* p, int x, int y, floatV q, floatV fx, float fy, floatV* right,
                      floatV* down, intV* mean) {
    floatV n[3];
    for (int c = 0; c < 3; ++c) {
        float lanes[V];
        for (int i = 0; i < V; ++i) {
            const bool inside = y >= 0 && y < (int)split->height && x + i >= 0 && x + i < (int)split->width;
            const size_t at = source->offset + (size_t)y * source->stride;
            lanes[i] = inside ? normals[at + (size_t)(EVERY * (x + i)) * source->channels + c] : 0;
        }
        n[c] = *(const float_lanes*)lanes;
    }
    const floatV given[3] = {n[0], n[1], n[2]};
    for (int c = 0; c < 3; ++c)
        n[c] = fma(given[0], (floatV)p->normals[c][0],
                   fma(given[1], (floatV)p->normals[c][1], given[2] * p->normals[c][2]));
    const floatV facing =
        fma(n[0], direction_at(p, 0, fx, fy), fma(n[1], direction_at(p, 1, fx, fy), n[2] * direction_at(p, 2, fx, fy)));
    const floatV scale = (PERSPECTIVE ? q : (floatV)1.0f) / facing;
    const floatV off = fma(given[0], given[0], fma(given[1], given[1], fma(given[2], given[2], (floatV)-1.0f)));
    *mean = (facing < 0.0f) & (off > SHORTEST_MEAN * SHORTEST_MEAN - 1.0f) & (off < 0.0f);
    for (int k = 0; k < 2; ++k) {
        const floatV step = fma(n[0], p->step[0][k], fma(n[1], p->step[1][k], n[2] * p->step[2][k]));
        *(k == 0 ? right : down) = select((floatV)0.0f, scale * step, facing < 0.0f);
    }
    const intV lane = (intV)x + LANE_INDEX(int);
    const bool above_or_below = y < 0 || y >= (int)split->height;
    const intV outside = (lane < 0) | (lane >= (int)split->width) | (intV)(above_or_below ? -1 : 0);
    return outside | ((facing < 0.0f) & (fabs(off) < 2.0f * NO_NORMAL));
}
#endif

KERNEL void ssao_planes(__global const float* depth, __global const float* extra, __global const float* normals,
                          __global const uint* blocks, __global float* fronts, __global float* backs,
                          __global float* slopes, const grid_params grid, const grid_params pixels,
                          const grid_params extra_grid, const source_params normals_source, const split_params split,
                          const block_params work, const occlusion_params occlusion) {
    const int column = (int)get_global_id(0) * V - split_margin;
    const int v = (int)(get_global_id(1) + grid.y_begin) - 4; // rows of the split image, its margins included
    if (!split.columns || column >= (int)split.columns + split_margin || !is_any_needed(blocks, &work))
        return;
    const int y = v - (int)(split.pixel_y & 3);
    const int left = 4 * column - (int)(split.pixel_x & 3);

    floatV front[4], back[4], slopes_here[4];
    for (int j = 0; j < 4; ++j) {
        const int x = left + j * V;
        const floatV q = row_at(depth, &grid, x, y, NAN);
        const intV known = !isnan(q), surface = known & (q > (PERSPECTIVE ? 0.0f : -FLT_MAX));
        front[j] = select(select((floatV)UNKNOWN, (floatV)NOTHING, known), q, surface);
        const floatV fx = convert_floatV((intV)x + LANE_INDEX(int)) + ((float)split.pixel_x + 0.5f);
        const float fy = (float)y + (float)split.pixel_y + 0.5f;
        const floatV length = ray_length(&occlusion, fx, fy);
#if THICKNESS == 0 || THICKNESS == 2
        const floatV thickness = (floatV)occlusion.thickness;
#else
        const floatV thickness = row_at(extra, &extra_grid, x, y, 0.0f);
#endif
#if PERSPECTIVE
        const floatV behind = q / fma(q, thickness / length, (floatV)1.0f);
#else
        const floatV behind = q - thickness / length;
#endif
        back[j] = select(front[j], behind, surface & (thickness >= 0.0f));
#if THICKNESS == 2
        const floatV end = row_at(extra, &extra_grid, x, y, NAN);
        back[j] = select(back[j], select((floatV)NOTHING, end, end > (PERSPECTIVE ? 0.0f : -FLT_MAX)),
                         surface & (end <= q));
#endif
        floatV right, down;
#if GIVEN_NORMALS == 3
        grid_params slopes_grid = grid;
        slopes_grid.source_offset = normals_source.offset;
        slopes_grid.source_stride = normals_source.stride;
        const floatV given = row_at(normals, &slopes_grid, x, y, 0.0f);
        right = EVERY * slope_right(given), down = EVERY * slope_down(given);
#elif GIVEN_NORMALS == 1
        intV mean, thin;
        const intV good = slopes_of(normals, &normals_source, &split, &occlusion, x, y, q, fx, fy, &right, &down, &mean);
        if (any_of(surface & !good)) {
            floatV own_right, own_down;
            slopes_of_depth(depth, &grid, &pixels, &occlusion, x, y, q, fx, fy, false, &own_right, &own_down, &thin);
            const intV given = good | (mean & thin);
            right = select(own_right, right, given), down = select(own_down, down, given);
        }
#else
        intV unused;
#if GIVEN_NORMALS == 2
        slopes_of(normals, &normals_source, &split, &occlusion, x, y, q, fx, fy, &right, &down, &unused);
#endif
        slopes_of_depth(depth, &grid, &pixels, &occlusion, x, y, q, fx, fy, GIVEN_NORMALS == 2, &right, &down, &unused);
#endif
        slopes_here[j] = select((floatV)0.0f, packed_slopes(right, down), surface);
    }

    floatV dealt[4];
    const uint at = (uint)((v + 4) >> 2) * split.stride + (uint)(column + split_margin);
    const uint first = (uint)(v & 3) * 4;
#define STORE(values, target)                                                                                          \
    DEAL(values, dealt);                                                                                               \
    for (uint phase = 0; phase < 4; ++phase)                                                                           \
    *(__global float_lanes*)((target) + (first + phase) * split.plane + at) = dealt[phase]
    STORE(front, fronts);
    STORE(back, backs);
    STORE(slopes_here, slopes);
}
