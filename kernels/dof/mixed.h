// What an antialiased picture mixes into the pixels beside an edge in depth. Depth is a point sample, so a pixel whose centre
// lies on the farther side of an edge has the farther circle, though a part of its colour is the nearer surface's:
//   C = B + a (F - B),  B one pixel away from the edge, F two pixels beyond it, a the part by least squares
// a (F - B) is then light of the nearer surface. Where C is not on the line from B to F, or a is more than a pixel can have
// whose centre lies beyond the edge, the pixel is taken to have a colour of its own.

#ifndef FATHOM_MIXED_H
#define FATHOM_MIXED_H

#include "dof/tiles.h"
#include "pixels.h"

#define EDGE_PX 1.0f       // circles of neighbours differ by more at an edge,
#define EDGE_RATIO 0.19f   // and by more than this of the larger one
#define OFF_LINE 0.01f     // squared, of the distance from B to F: up to this a colour lies on the line;
#define OFF_LINE_END 0.04f // from this on it does not
#define MOST_PART 0.5f     // what a pixel may have of the nearer surface; half a pixel is that of a straight edge
#define MOST_PART_END 0.8f // and what it never has
#define BLURRED_PX 0.5f    // circles larger than a pixel by this are blurred
#define STAYS_PX 1.5f      // foregrounds whose circles are larger than a pixel by this are not sharp
#define MOVES_PX 1.0f      // from circles larger than a pixel by this on, light moves to the foreground,
#define MOVES_ALL_PX 9.0f  // and all of it from this on

// A circle less a pixel, with its sign: 0 for what is in focus. It grows with the layer.
INLINE float excess_of(float layer, const blur_params* p) {
    const float away = fabs(layer - (float)p->middle) / p->per_octave, octave = floor(away);
    const float size = ldexp((1.0f + p->offset) * (1.0f + (away - octave)), (int)octave) - p->offset - 1.0f;
    return layer < (float)p->middle ? -size : size;
}

INLINE float rising(float x, float from, float to) {
    return min(max((x - from) / (to - from), 0.0f), 1.0f);
}

INLINE float layer_at(__global const float* planes, const blur_params* p, int column, int row) {
    if (row < 0 || row >= (int)p->rows)
        return NOWHERE;
    return planes[(size_t)row * p->stride + (size_t)(dof_margin + column)];
}

// The nearest and the farthest layer of a pixel and its neighbours, and on which side of an edge between them it lies.
typedef struct {
    float layer, least, greatest; // layers
    float nearest, farthest;      // circles less a pixel
    int side;                     // -1 on the nearer side, 1 on the farther one, 0 where there is no edge
} edge_at;

INLINE edge_at edge_around(__global const float* planes, const blur_params* p, int column, int row) {
    edge_at e = {layer_at(planes, p, column, row), INFINITY, NOWHERE, 0.0f, 0.0f, 0};
    if (!(e.layer >= 0.0f))
        return e;
    for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            const float other = layer_at(planes, p, column + dx, row + dy);
            e.least = other >= 0.0f ? min(e.least, other) : e.least;
            e.greatest = max(e.greatest, other);
        }
    }
    if (e.greatest - e.least <= p->per_octave * 0.125f)
        return e;
    e.nearest = excess_of(e.least, p);
    e.farthest = excess_of(e.greatest, p);
    const float step = e.farthest - e.nearest, here = excess_of(e.layer, p);
    if (step > max(EDGE_PX, EDGE_RATIO * max(fabs(e.nearest), fabs(e.farthest))))
        e.side = here - e.nearest < e.farthest - here ? -1 : 1;
    return e;
}

INLINE bool is_about(__global const float* planes, const blur_params* p, int column, int row, float excess,
                     float most) {
    const float layer = layer_at(planes, p, column, row);
    return layer >= 0.0f && fabs(excess_of(layer, p) - excess) < most;
}

INLINE void color_at(__global const ELEMENT_TYPE* color, const grid_params* grid, const blur_params* p, int column,
                     int row, float* value) {
    const size_t at = grid->source_offset + (size_t)(row - (int)p->top) * grid->source_stride +
                      (size_t)(CHANNELS * (column - (int)p->left));
    for (int k = 0; k < CHANNELS; ++k)
        value[k] = read_element(color, at + k);
}

#define COLORS (CHANNELS < 3 ? CHANNELS : 3)

// Light of a nearer surface in a pixel beyond its edge, and the neighbour on that surface to which a part of it moves.
typedef struct {
    float light[CHANNELS];
    float moves, stays; // parts of it; what is left remains in the pixel
    int column, row;
} mixed_light;

// Is there any?
INLINE bool light_of_nearer(__global const float* planes, __global const ELEMENT_TYPE* color, const grid_params* grid,
                            const blur_params* p, int column, int row, const edge_at* e, mixed_light* found) {
    const float blurred = min(max(fabs(e->nearest), fabs(e->farthest)) * (1.0f / BLURRED_PX), 1.0f);
    int across = 0, down = 0; // from the nearer side to the farther one
    for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            const float layer = layer_at(planes, p, column + dx, row + dy);
            if (!(layer >= 0.0f))
                continue;
            const float here = excess_of(layer, p);
            const int side = here - e->nearest < e->farthest - here ? -1 : 1;
            across += side * dx;
            down += side * dy;
        }
    }
    const int wide = abs(across), high = abs(down), most = max(wide, high), least = min(wide, high);
    if (most == 0)
        return false;
    // One and two pixels away from the edge, along the nearest of 8 and of 16 directions.
    const int sign_x = across < 0 ? -1 : across > 0, sign_y = down < 0 ? -1 : down > 0;
    const bool slants = 12 * least > 5 * most;
    const int one_x = wide == most || slants ? sign_x : 0, one_y = high == most || slants ? sign_y : 0;
    const int side_step = 4 * least < most ? 0 : 8 * least < 7 * most ? 1 : 2;
    const int two_x = sign_x * (wide == most ? 2 : side_step), two_y = sign_y * (high == most ? 2 : side_step);
    const float alike = max(EDGE_PX, 0.5f * (e->farthest - e->nearest));
    if (!is_about(planes, p, column + one_x, row + one_y, e->farthest, alike))
        return false;
    // Straight across the edge, else along a row or a column, else across a corner: the same for a picture upside down.
    int to_x = -one_x, to_y = -one_y;
    for (int i = 0; !is_about(planes, p, column + to_x, row + to_y, e->nearest, alike); ++i) {
        if (i == 3)
            return false;
        to_x = i == 1 ? 0 : -sign_x;
        to_y = i == 0 ? 0 : -sign_y;
    }
    found->column = column + to_x;
    found->row = row + to_y;
    const bool deep = is_about(planes, p, column - two_x, row - two_y, e->nearest, alike);
    float here[CHANNELS], far[CHANNELS], near[CHANNELS];
    color_at(color, grid, p, column, row, here);
    color_at(color, grid, p, column + one_x, row + one_y, far);
    color_at(color, grid, p, deep ? column - two_x : found->column, deep ? row - two_y : found->row, near);
    float along = 0.0f, length = 0.0f; // of the colours: an alpha follows them
    for (int k = 0; k < COLORS; ++k) {
        along = fma(here[k] - far[k], near[k] - far[k], along);
        length = fma(near[k] - far[k], near[k] - far[k], length);
    }
    if (!(along > 0.0f && length < INFINITY))
        return false;
    const float part = along / length;
    float off = 0.0f;
    for (int k = 0; k < COLORS; ++k) {
        const float beside = fma(-part, near[k] - far[k], here[k] - far[k]);
        off = fma(beside, beside, off);
    }
    const float its = min(part, 1.0f) * blurred * (1.0f - rising(off / length, OFF_LINE, OFF_LINE_END)) *
                      (1.0f - rising(part, MOST_PART, MOST_PART_END));
    if (!(its > 0.0f))
        return false;
    const edge_at other = edge_around(planes, p, found->column, found->row);
    const float circle = fabs(excess_of(other.layer, p));
    found->moves = other.side < 0 ? rising(circle, MOVES_PX, MOVES_ALL_PX) : 0.0f;
    found->stays = min(1.0f - rising(circle, 0.0f, STAYS_PX), 1.0f - found->moves);
    for (int k = 0; k < CHANNELS; ++k)
        found->light[k] = its * (near[k] - far[k]);
    return true;
}

#endif
