// Rows of the pixels that occlusion is computed for: all of an image, or every second one of every second row.
// Built for: EVERY = 1 2

#ifndef FATHOM_LATTICE_H
#define FATHOM_LATTICE_H

#include "vector.h"

#ifndef EVERY
#error "EVERY is not defined: 1 for all pixels, 2 for every second one of a row; strides say which rows"
#endif

// V neighbours of a row, from one of them on.
INLINE floatV load_every(__global const float* first) {
#if EVERY == 2 && V > 1
    const floatV a = LOAD(float, first), b = LOAD(float, first + V);
    return (floatV)(a.even, b.even);
#else
    return LOAD(float, first);
#endif
}

// The same from pixel x of a row on, NaN beyond its `width` pixels.
INLINE floatV in_row(__global const float* row, int x, int width) {
    if (x >= width || x + EVERY * V <= 0)
        return (floatV)NAN;
    if (x >= 0 && x + EVERY * V <= width)
        return load_every(row + x);
    float lanes[V];
    for (int i = 0; i < V; ++i)
        lanes[i] = x + EVERY * i >= 0 && x + EVERY * i < width ? row[x + EVERY * i] : NAN;
    return *(const float_lanes*)lanes;
}

// From pixel (x, y) of the image on; NaN beyond it.
INLINE floatV pixels_at(__global const float* image, const grid_params* pixels, int x, int y) {
    if (y < 0 || y >= (int)pixels->height)
        return (floatV)NAN;
    return in_row(image + pixels->source_offset + (size_t)y * pixels->source_stride, x, (int)pixels->x_end);
}

#endif
