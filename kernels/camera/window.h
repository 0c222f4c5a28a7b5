// The pixels beside a work-item's own, in an image of inverse depth with its margin of invalid pixels.

#ifndef FATHOM_WINDOW_H
#define FATHOM_WINDOW_H

#include "vector.h"

typedef struct {
    __global const float* here; // the work-item's first pixel
    long stride;
} window;

INLINE window window_at(__global const float* source, const grid_params* grid, int x, int y) {
    return (window){source + grid->source_offset + (size_t)y * grid->source_stride + x, (long)grid->source_stride};
}

// The pixels dx to the right and dy down: NaN outside the image, as far as the margin reaches.
INLINE floatV neighbour(const window* w, int dx, int dy) {
    return LOAD(float, w->here + dy * w->stride + dx);
}

#endif
