// Lanes of pixels beside a work-item's own, in an image of inverse depth.

#ifndef FATHOM_WINDOW_H
#define FATHOM_WINDOW_H

#include "vector.h"

// The pixels around this work-item's, in an image of inverse depth.
typedef struct {
    __global const float* source; // of the pixel (0, y)
    int x, y, width, height, stride;
} window;

INLINE window window_at(__global const float* source, const grid_params* grid, int x, int y) {
    return (window){.source = source + grid->source_offset + (size_t)y * grid->source_stride,
                    .x = x,
                    .y = y,
                    .width = (int)grid->x_end,
                    .height = (int)grid->height,
                    .stride = (int)grid->source_stride};
}

// Those dx to the right and dy down; NaN beyond the image's borders, unless the whole window lies `inside`.
INLINE floatV neighbour(const window* w, int inside, int dx, int dy) {
    const int first = w->x + dx, row = w->y + dy;
    __global const float* const source = w->source + (long)dy * w->stride;
    if (inside)
        return LOAD(float, source + first);
    float lanes[V];
    for (int i = 0; i < V; ++i) {
        const int there = row >= 0 && row < w->height && first + i >= 0 && first + i < w->width;
        lanes[i] = there ? source[first + i] : NAN;
    }
    return *(const float_lanes*)lanes;
}

#endif
