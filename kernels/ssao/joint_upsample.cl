// Joint upsampling: from a result for every second pixel of every second row to all of them.
//   value = sum_n w_n value_n / sum_n w_n,   w = how near neighbour n lies to this pixel's tangent plane
// A pixel without a result of its own takes those of two or four neighbours, weighted by how well inverse depth says
// that they lie on its surface. Where none does, the one closest in depth counts. So nothing is mixed across an edge.
// Kopf et al. 2007, "Joint Bilateral Upsampling"; the plane, and what may lie off it, are those of denoise.cl.
// Built for: OUTPUT = 0 1 2

#include "ssao/blocks.h"
#include "ssao/ray.h"
#include "ssao/upsampled.h"
#include "normals/slope.h"
#include "camera/window.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in the camera centre, 0 where they are parallel (orthographic)"
#endif

// 2 V neighbours of a row: those of even and those of odd columns of the camera's image.
typedef struct {
    floatV even, odd;
} columnsV;

INLINE columnsV columns_at(const window* w, int dx, int dy) {
    const floatV a = neighbour(w, dx, dy), b = neighbour(w, dx + V, dy);
#if V == 1
    return (columnsV){a, b};
#else
    return (columnsV){(floatV)(a.even, b.even), (floatV)(a.odd, b.odd)};
#endif
}

INLINE columnsV surfaces_at(const window* w, int dx, int dy) {
    const columnsV q = columns_at(w, dx, dy);
    return (columnsV){surface_only(q.even), surface_only(q.odd)};
}

// The pixels of each lane, their tangent planes, and what they take from those beside them.
typedef struct {
    floatV q, right, down;
    floatV edge; // how far a neighbour may lie off
    floatV whole, sum[CHANNELS];
} centreV;

INLINE centreV centre_at(const occlusion_params* p, floatV x, float y, const floatV* across, floatV q,
                         const floatV* along) {
    centreV c = {.q = q, .whole = 0.0f};
    for (int i = 0; i < CHANNELS; ++i)
        c.sum[i] = 0.0f;
    const floatV tolerance = 4.0f * depth_error(p, q);
    const floatV step =
        fma((PERSPECTIVE ? q * q : (floatV)1.0f) / ray_length(p, x, y), (floatV)(THIN * p->radius), tolerance);
    const floatV size = PERSPECTIVE ? fabs(q) * p->pixel : (floatV)p->pixel;
    c.right = unless_thin(slope(across[0], across[1], q, across[2], across[3], tolerance), across, q, step, tolerance, size);
    c.down = unless_thin(slope(along[0], along[1], q, along[2], along[3], tolerance), along, q, step, tolerance, size);
    const floatV steep = fma(c.right, c.right, c.down * c.down);
    c.edge = fma((floatV)p->edge, sqrt(fma(size, size, steep)), tolerance);
    return c;
}

// V results from a column on; NaN outside.
INLINE void results_at(__global const float* results, const grid_params* grid, int column, int row, floatV* values) {
    const bool there = row >= 0 && row < (int)grid->height;
    __global const float* const from = results + grid->source_offset + (size_t)max(row, 0) * grid->source_stride;
#if CHANNELS == 1
    if (there && column >= 0 && column + V <= (int)grid->x_end) {
        values[0] = LOAD(float, from + column);
        return;
    }
#endif
    for (int c = 0; c < CHANNELS; ++c) {
        float lanes[V];
        for (int i = 0; i < V; ++i) {
            const bool inside = there && column + i >= 0 && column + i < (int)grid->x_end;
            lanes[i] = inside ? from[(column + i) * CHANNELS + c] : NAN;
        }
        values[c] = *(const float_lanes*)lanes;
    }
}

// Adds the result of the pixel dx to the right and dy down, whose inverse depth is q.
INLINE void take(centreV* c, floatV q, const floatV* values, float dx, float dy) {
    const floatV off = fabs(fma(c->right, (floatV)dx, fma(c->down, (floatV)dy, c->q)) - q);
    const floatV weight = max(1.0f - off / c->edge, 0.0f) + NEAREST * c->edge / (c->edge + off);
    const intV counts = off < INFINITY;
    c->whole += select((floatV)0.0f, weight, counts);
    for (int i = 0; i < CHANNELS; ++i)
        c->sum[i] += select((floatV)0.0f, weight * values[i], counts);
}

INLINE void finish(const centreV* c, floatV q, floatV* values) {
    const intV known = !isnan(q), surface = known & (q > (PERSPECTIVE ? 0.0f : -FLT_MAX));
#if OUTPUT == 2
    const floatV length = sqrt(fma(c->sum[0], c->sum[0], fma(c->sum[1], c->sum[1], c->sum[2] * c->sum[2])));
    for (int i = 0; i < 3; ++i) {
        const floatV unit = select((floatV)0.0f, c->sum[i] / length, surface & (length > 0.0f));
        values[i] = select((floatV)NAN, unit, known);
    }
#else
    const floatV mean = min(max(c->sum[0] / c->whole, 0.0f), 1.0f);
    const floatV unknown = OUTPUT == 0 ? 1.0f : 0.0f; // no neighbour has a result
    values[0] = select((floatV)NAN, select((floatV)1.0f, select(unknown, mean, c->whole > 0.0f), surface), known);
#endif
}

// Beside a block at half resolution a block of all pixels passes over into it, so that no seam shows. SEAM_END pixels from it
// the block has its own results. Up to SEAM_BEGIN pixels it has those of half resolution: its filter lacks what lies beyond.
#define SEAM_BEGIN 2
#define SEAM_END 10

// The fraction of half resolution for V pixels of a block of all pixels, in column `ix` and row `iy` of the block.
INLINE floatV half_weight(__global const uint* blocks, const block_params* p, int column, int row, int ix, int iy) {
    const int last = (1 << ssao_block_shift) - 1;
    const intV from_left = (intV)ix + LANE_INDEX(int), from_right = last - from_left;
    floatV weight = 0.0f;
    for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            if (block_at(blocks, p, column + dx, row + dy) == WHOLE)
                continue;
            const intV across = dx < 0 ? from_left : dx > 0 ? from_right : (intV)0;
            const floatV away = convert_floatV(max(across, (intV)(dy < 0 ? iy : dy > 0 ? last - iy : 0)));
            weight = max(weight, (SEAM_END - away) * (1.0f / (SEAM_END - SEAM_BEGIN)));
        }
    }
    return min(weight, 1.0f);
}

// V values of a row of the region, and the same from memory.
INLINE void store_row(__global float* to, int begin, int end, const floatV* values) {
    if (CHANNELS == 1 && begin == 0 && end == V) {
        *(__global float_lanes*)to = values[0];
        return;
    }
    for (int c = 0; c < CHANNELS; ++c) {
        const float_lanes lanes = values[c];
        for (int i = begin; i < end; ++i)
            to[CHANNELS * i + c] = ((const float*)&lanes)[i];
    }
}
INLINE void load_row(__global const float* from, int begin, int end, floatV* values) {
    for (int c = 0; c < CHANNELS; ++c) {
        float lanes[V];
        for (int i = 0; i < V; ++i)
            lanes[i] = i >= begin && i < end ? from[CHANNELS * i + c] : 0.0f;
        values[c] = *(const float_lanes*)lanes;
    }
}

// Replaces results by those that lie in memory, but for the fraction `weight`.
INLINE void blend(__global const float* whole, int begin, int end, floatV weight, floatV* values) {
    floatV own[CHANNELS], square = 0.0f;
    load_row(whole, begin, end, own);
    for (int c = 0; c < CHANNELS; ++c) {
        const floatV between = fma(weight, values[c] - own[c], own[c]);
        values[c] = select(select(own[c], between, weight > 0.0f), values[c], weight >= 1.0f);
        square = fma(values[c], values[c], square);
    }
#if OUTPUT == 2
    const floatV length = sqrt(square);
    const intV mixed = (weight > 0.0f) & (weight < 1.0f) & (length > 0.0f);
    for (int c = 0; c < CHANNELS; ++c)
        values[c] = select(values[c], values[c] / length, mixed);
#endif
}

KERNEL void joint_upsample(__global const float* depth, __global const float* results, __global const uint* blocks,
                             __global float* target, const grid_params grid, const grid_params results_grid,
                             const grid_params target_grid, const block_params work, const occlusion_params p) {
    // Work-items begin at multiples of 2 V of the camera's columns: each lies in one block.
    const int left = (int)(grid.pixel_x & 1), top = (int)(grid.pixel_y & 1);
    const int x = 2 * V * (int)get_global_id(0) - (int)(grid.pixel_x & (2 * V - 1)), column = (x + left) >> 1;
    const int y = (int)get_global_id(1) + (int)target_grid.y_begin;
    if (x >= (int)target_grid.x_end || x + 2 * V <= (int)target_grid.x_begin)
        return;
    floatV weights[2] = {1.0f, 1.0f};
    bool mixed = false;
    if (work.columns > 0) {
        const int camera_x = x + (int)grid.pixel_x, camera_y = y + (int)grid.pixel_y, last = (1 << ssao_block_shift) - 1;
        const int block_x = block_column(&work, camera_x), block_y = block_row(&work, camera_y);
        mixed = block_at(blocks, &work, block_x, block_y) == WHOLE;
        for (int j = 0; j < 2 && mixed; ++j)
            weights[j] = half_weight(blocks, &work, block_x, block_y, (camera_x & last) + j * V, camera_y & last);
        if (!any_of((weights[0] > 0.0f) | (weights[1] > 0.0f)))
            return;
    }
    const window w = window_at(depth, &grid, x, y);
    const columnsV here = columns_at(&w, 0, 0);
    const columnsV surface = {surface_only(here.even), surface_only(here.odd)};
    const columnsV before = surfaces_at(&w, -2, 0), after = surfaces_at(&w, 2, 0);
    const columnsV up = surfaces_at(&w, 0, -1), down = surfaces_at(&w, 0, 1);
    const columnsV up2 = surfaces_at(&w, 0, -2), down2 = surfaces_at(&w, 0, 2);

    const float py = (float)(y + (int)grid.pixel_y) + 0.5f;
    const floatV px = convert_floatV((intV)(x + (int)grid.pixel_x) + 2 * LANE_INDEX(int)) + 0.5f;
    const floatV across_even[4] = {before.even, before.odd, surface.odd, after.even};
    const floatV across_odd[4] = {before.odd, surface.even, after.even, after.odd};
    const floatV along_even[4] = {up2.even, up.even, down.even, down2.even};
    const floatV along_odd[4] = {up2.odd, up.odd, down.odd, down2.odd};
    centreV even = centre_at(&p, px, py, across_even, surface.even, along_even);
    centreV odd = centre_at(&p, px + 1.0f, py, across_odd, surface.odd, along_odd);

    const int between = (y + top) & 1;
    floatV of_left[CHANNELS], of_right[CHANNELS];
    for (int dy = -between; dy <= between; dy += 2) {
        const int row = ((y + dy + top) >> 1) - top;
        results_at(results, &results_grid, column - left, row, of_left);
        results_at(results, &results_grid, column - left + 1, row, of_right);
        const floatV q_left = dy == 0 ? surface.even : dy < 0 ? up.even : down.even;
        const floatV q_right = dy == 0 ? after.even : surfaces_at(&w, 2, dy).even;
        take(&even, q_left, of_left, 0, (float)dy);
        take(&odd, q_left, of_left, -1, (float)dy);
        take(&odd, q_right, of_right, 1, (float)dy);
    }

    floatV to_even[CHANNELS], to_odd[CHANNELS];
    finish(&even, here.even, to_even);
    finish(&odd, here.odd, to_odd);
    const int first = (int)target_grid.x_begin, end = (int)target_grid.x_end;
    __global float* const row = target + target_grid.target_offset + (size_t)get_global_id(1) * target_grid.target_stride;
    for (int j = 0; j < 2; ++j) {
        floatV values[CHANNELS];
        for (int c = 0; c < CHANNELS; ++c) {
            const floatV in_even = between ? to_even[c] : of_left[c];
#if V == 1
            values[c] = j == 0 ? in_even : to_odd[c];
#else
            values[c].even = j == 0 ? in_even.lo : in_even.hi;
            values[c].odd = j == 0 ? to_odd[c].lo : to_odd[c].hi;
#endif
        }
        const int from = x + j * V, begin = clamp(first - from, 0, V), until = clamp(end - from, 0, V);
        __global float* const to = row + CHANNELS * (from - first);
        if (mixed)
            blend(to, begin, until, weights[j], values);
        store_row(to, begin, until, values);
    }
}
