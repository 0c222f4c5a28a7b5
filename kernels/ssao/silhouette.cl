// Thickness of what each pixel shows, from the width of its silhouette: a solid is about as deep as it is wide.
//   T = min over the row, the column and two diagonals of (n+ + n- - 1) s w,   between least and most
// or over the row and the column alone, which is faster and takes what leans for thicker.
// s is the length of a pixel's step at distance one, w the pixel's depth. n+ and n- are the samples to either side at which
// the image first shows something farther: deeper than the pixel by more than `farther` and by more than that sample lies
// aside. Samples are 1, 2, 3, 4, 6, 8, 12, 16 ... pixels away, so either side of a run is too long by less than half. A sample
// that is invalid or outside the image is not farther: a run that leaves the image is as wide as can be.
// No sample is as far away as `most`, so nothing beyond that distance changes a pixel.
// Every second pixel of every second row is enough where no block is computed at all pixels, and has the same bits.
// Built for: PERSPECTIVE = 0 1

#include "ssao/blocks.h"
#include "ssao/lattice.h"
#include "ssao/ray.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in the camera centre, 0 where they are parallel (orthographic)"
#endif

#define NEVER 1e30f // samples to where nothing is farther

// Downwards first: where a floor comes nearer nothing is farther, and then the other side need not be looked at.
__constant int step_x[4] = {1, 0, 1, -1}, step_y[4] = {0, 1, 1, 1};

// Pixels along a row or column from which no vector leaves the image.
INLINE int room_before(int step, int at, int size) {
    return step < 0 ? at : step > 0 ? size - 1 - at : INT_MAX;
}

// What decides whether a sample is farther: of the pixel, and of the direction.
typedef struct {
    floatV deeper;  // than the pixel next to it: a factor of its inverse depth, or a length
    floatV nearest; // inverse depth of the pixel at least, though the stored one may be off
} pixelV;

INLINE floatV found_at(floatV found, floatV there, int n, float step, const pixelV* pixel) {
    const floatV deeper = pixel->deeper + (float)n * step;
    const intV farther = (PERSPECTIVE ? there * deeper : there + deeper) < pixel->nearest;
    return select(found, (floatV)(float)n, farther);
}

KERNEL void silhouette(__global const float* depth, __global const uint* blocks, __global float* thickness,
                         const grid_params grid, const block_params whole, const occlusion_params occlusion,
                         const silhouette_params p) {
    const int x = (int)p.first_x + (int)get_global_id(0) * EVERY * V, y = (int)p.first_y + (int)get_global_id(1) * EVERY;
    if (x >= (int)grid.x_end || y >= (int)grid.height)
        return;
    if (whole.columns != 0 && is_any_needed(blocks, &whole) != (EVERY == 1))
        return;
    const floatV q = pixels_at(depth, &grid, x, y);
    pixelV pixel;
    pixel.nearest = q - 4.0f * depth_error(&occlusion, q);
#if PERSPECTIVE
    const intV surface = (q > 0.0f) & (q < INFINITY);
    const floatV inverse_depth = select((floatV)1.0f, q, surface);
    pixel.deeper = fma((floatV)p.farther, inverse_depth, (floatV)1.0f);
#else
    const intV surface = fabs(q) < INFINITY;
    const floatV inverse_depth = 1.0f;
    pixel.deeper = p.farther;
#endif
    const floatV reach = select((floatV)0.0f, p.reach * inverse_depth, surface);
    const int farthest =
        min(greatest(convert_intV(ceil(min(reach, 1e6f)))), max((int)grid.x_end, (int)grid.height));
    int last = 0; // power of two that is sampled
    while (max(2 * last, 1) < farthest)
        last = max(2 * last, 1);

    __global const float* const here = depth + grid.source_offset + (size_t)y * grid.source_stride + x;
    floatV width = NEVER; // at distance one
    for (uint direction = 0; direction < p.directions; ++direction) {
        const float step = p.step[direction];
        floatV run = -1.0f;
        for (int side = 0; side < 2; ++side) {
            const int dx = side ? -step_x[direction] : step_x[direction];
            const int dy = side ? -step_y[direction] : step_y[direction];
            const int room = min(room_before(dx, dx > 0 ? x + EVERY * V - 1 : x, (int)grid.x_end),
                                 room_before(dy, y, (int)grid.height));
            const int to_next = dy * (int)grid.source_stride + dx;
            floatV found = NEVER;
            for (int n = last; n > 0; n /= 2) {
                const int between = n > 1 && 3 * n / 2 < farthest ? 3 * n / 2 : n;
                if (between <= room) {
                    found = found_at(found, load_every(here + between * to_next), between, step, &pixel);
                    found = found_at(found, load_every(here + n * to_next), n, step, &pixel);
                } else {
                    found = found_at(found, pixels_at(depth, &grid, x + between * dx, y + between * dy), between, step, &pixel);
                    found = found_at(found, pixels_at(depth, &grid, x + n * dx, y + n * dy), n, step, &pixel);
                }
            }
            run += select((floatV)NEVER, found, found < reach);
            if (!any_of(run < NEVER / 2))
                break;
        }
        width = min(width, run * step);
    }
    __global float* const target = thickness + grid.target_offset + (size_t)y * grid.target_stride + x;
    const floatV found_here = clamp(width / inverse_depth, p.least, p.most);
#if EVERY == 1
    *(__global float_lanes*)target = found_here;
#else
    for (int i = 0; i < V; ++i)
        target[EVERY * i] = ((const float*)&found_here)[i];
#endif
}
