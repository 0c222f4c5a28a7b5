// What an antialiased picture mixes into the pixels beside an edge in depth. Depth is a point sample, so a pixel whose centre
// lies on the farther side of an edge has the farther circle, though a part of its colour is the nearer surface's:
//   C = B + a (F - B),  B one pixel away from the edge, F two pixels beyond it, a the part by least squares
// The pixel is then two fragments, of area a and 1 - a, whose colours' mean is C. Each lies between C and the colour on its side
// of the edge, so neither has a colour that no pixel has. Where C is not on the line from B to F, or a is more than a pixel can
// have whose centre lies beyond the edge, the pixel is taken to have a colour of its own. A sharp surface and a lamp take more,
// because their light in the farther circle would show: as dashes in place of hair, and as lamps that are too large.

#ifndef FATHOM_MIXED_H
#define FATHOM_MIXED_H

#include "dof/tiles.h"
#include "edge.h"
#include "pixels.h"

#define EDGE_PX 1.0f       // circles of neighbours differ by more at an edge,
#define EDGE_RATIO 0.19f   // and by more than this of the larger one
#define OFF_LINE 0.01f     // squared, of the distance from B to F: up to this a colour lies on the line;
#define OFF_LINE_END 0.04f // from this on it does not
#define MOST_PART 0.5f     // what a pixel may have of the nearer surface; half a pixel is that of a straight edge
#define MOST_PART_END 0.8f // and what it never has
#define BLURRED_PX 0.5f    // circles larger than a pixel by this are blurred
#define STAYS_PX 1.5f      // foregrounds whose circles are larger than a pixel by this are not sharp
// A foreground whose circle is larger than a pixel by this takes all of its fragment. With a smaller circle it takes a part that
// grows with the circle's area, since such a blur does not hide that the fragment has moved by a pixel.
#define MOVES_ALL_PX 7.0f
#define LEAST_STRAND 0.05f // what a pixel has of a sharp strand: up to this it keeps nothing of it,
#define MOST_STRAND 0.15f  // from this on all,
#define BEYOND_STRAND 1.5f // unless it is so much more than the strand's own pixels have,
#define BEYOND_STRAND_END 2.5f
#define PLAIN_STEPS 6     // A background is plain if pixels on eight ways, so many of every second one on each,
#define PLAIN_PIXELS 1.0f // of which so many at least are of the background alone,
#define PLAIN 0.01f       // differ by no more, squared, of the way to the strand's colour.
#define LAMP 1.0f         // light of which more than a part is moved, since the rest would show in the farther circle,
#define LAMP_END 4.0f     // and of which all is

INLINE float layer_at(__global const float* planes, const blur_params* p, int column, int row) {
    if (row < 0 || row >= (int)p->rows)
        return NOWHERE;
    return planes[(size_t)row * p->stride + (size_t)(dof_margin + column)];
}

// A pixel and its eight neighbours, row by row.
#define HERE 4
typedef struct {
    float excess[9];         // NaN where there is no circle
    float nearest, farthest; // of them
    int side;                // -1 on the nearer side of an edge, 1 on the farther one, 0 where there is no edge
} edge_at;

INLINE edge_at edge_around(__global const float* planes, const blur_params* p, int column, int row) {
    edge_at e;
    float4 least = INFINITY, greatest = -INFINITY;
    for (int n = 0; n < 9; n += 3) {
        const int y = row + n / 3 - 1;
        float4 excess = NAN;
        if (y >= 0 && y < (int)p->rows) {
            const float4 layers = vload4(0, planes + (size_t)y * p->stride + (size_t)(dof_margin + column - 1));
            excess = select((float4)(NAN), excess_of_4(layers, p), (layers >= 0.0f) & (int4)(-1, -1, -1, 0));
        }
        least = fmin(least, excess);
        greatest = fmax(greatest, excess);
        vstore3(excess.xyz, 0, e.excess + n);
    }
    e.nearest = min(min(least.x, least.y), least.z);
    e.farthest = max(max(greatest.x, greatest.y), greatest.z);
    e.side = 0;
    if (e.farthest - e.nearest > max(EDGE_PX, EDGE_RATIO * max(fabs(e.nearest), fabs(e.farthest))))
        e.side = e.excess[HERE] <= 0.5f * (e.nearest + e.farthest) ? -1 : 1;
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

// Of three colours: the same for red first and blue first.
INLINE float product_of(const float* a, const float* b) {
    return fma(a[1], b[1], a[0] * b[0] + a[2] * b[2]);
}

// Ways from a pixel beyond an edge.
typedef struct {
    int one_x, one_y; // a pixel away from the edge
    int two_x, two_y; // two pixels, which are taken towards it
    int to_x, to_y;   // to the neighbour on the nearer surface
    float alike;      // circles of one surface differ by less
} across_edge;

INLINE bool find_across(const edge_at* e, across_edge* found) {
    const float middle = 0.5f * (e->nearest + e->farthest);
    int across = 0, down = 0; // from the nearer side to the farther one
    for (int n = 0; n < 9; ++n) {
        const float here = e->excess[n];
        const int side = (here > middle) - (here <= middle); // none where there is no circle
        across += side * (n % 3 - 1);
        down += side * (n / 3 - 1);
    }
    if (across == 0 && down == 0)
        return false;
    const edge_way way = way_from_edge(across, down);
    const int one_x = way.one_x, one_y = way.one_y;
    const float alike = max(EDGE_PX, 0.5f * (e->farthest - e->nearest));
    if (!(fabs(e->excess[HERE + one_x + 3 * one_y] - e->farthest) < alike))
        return false;
    // Straight across the edge, else along a row or a column, else across a corner: the same for a picture upside down.
    int to_x = -one_x, to_y = -one_y;
    for (int i = 0; !(fabs(e->excess[HERE + to_x + 3 * to_y] - e->nearest) < alike); ++i) {
        if (i == 3)
            return false;
        to_x = i == 1 ? 0 : -way.sign_x;
        to_y = i == 0 ? 0 : -way.sign_y;
    }
    *found = (across_edge){one_x, one_y, way.two_x, way.two_y, to_x, to_y, alike};
    return true;
}

// Parts of a nearer surface's fragment in a pixel beyond its edge: what joins the neighbour on the nearer surface, and what stays
// on top of the blur. What is left remains in the pixel.
typedef struct {
    float moves, stays;
} fragment_parts;

INLINE bool is_sharp(const edge_at* e) { // is the nearer surface?
    return fabs(e->nearest) < STAYS_PX;
}

INLINE float is_of_lamp(const float* color) {
    return rising(max(max(color[0], color[1]), color[2]), LAMP, LAMP_END);
}

// `nearer` is the edge as that neighbour sees it, which lies there and has this colour.
INLINE fragment_parts parts_of_fragment(const edge_at* nearer, const float* color) {
    const float circle = fabs(nearer->excess[HERE]), moving = rising(circle, 0.0f, MOVES_ALL_PX);
    const float blurred = rising(circle, 0.0f, STAYS_PX);
    const float all = max(moving * sqrt(moving), blurred * is_of_lamp(color));
    const float moves = nearer->side < 0 ? all : 0.0f;
    return (fragment_parts){moves, min(1.0f - blurred, 1.0f - moves)};
}

// A pixel that is taken apart: the nearer surface's part of its area, and the colours of either part.
typedef struct {
    float part;
    float near[CHANNELS], far[CHANNELS];
} fragments;

// Does a colour have more light than its alpha lets through, as that of a lamp? Then its parts may, too.
INLINE bool light_beyond_alpha(const float* color) {
    return CHANNELS == 3 || max(max(color[0], color[1]), color[2]) > color[CHANNELS - 1];
}

// The colours of both parts of a pixel, which lie between its own and those on both sides, and whose mean is its own.
INLINE void split_color(const float* here, const float* near, const float* far, fragments* of) {
    const float rest = max(1.0f - of->part, 0x1p-20f);
    const bool may_shine = light_beyond_alpha(here) || light_beyond_alpha(far) || light_beyond_alpha(near);
    for (int k = CHANNELS - 1; k >= 0; --k) { // alpha first
        of->far[k] = between(fma(-of->part, near[k], here[k]) / rest, here[k], far[k]);
        if (!may_shine)
            of->far[k] = min(of->far[k], of->far[CHANNELS - 1]);
        of->near[k] = between(fma(-rest, of->far[k], here[k]) / of->part, here[k], near[k]);
        if (!may_shine)
            of->near[k] = min(of->near[k], of->near[CHANNELS - 1]);
    }
}

// Is there anything of a nearer surface? `taken` is what parts its fragment has that leave the pixel.
INLINE bool take_apart(__global const float* planes, __global const ELEMENT_TYPE* color, const grid_params* grid,
                       const blur_params* p, int column, int row, const edge_at* e, const across_edge* way, float taken,
                       fragments* of) {
    const float blurred = min(max(fabs(e->nearest), fabs(e->farthest)) * (1.0f / BLURRED_PX), 1.0f);
    const bool deep = is_about(planes, p, column - way->two_x, row - way->two_y, e->nearest, way->alike);
    float here[CHANNELS], far[CHANNELS], near[CHANNELS], from_far[3], to_near[3];
    color_at(color, grid, p, column, row, here);
    color_at(color, grid, p, column + way->one_x, row + way->one_y, far);
    color_at(color, grid, p, column + (deep ? -way->two_x : way->to_x),
             row + (deep ? -way->two_y : way->to_y), near);
    for (int k = 0; k < 3; ++k) {
        from_far[k] = here[k] - far[k];
        to_near[k] = near[k] - far[k];
    }
    const float along = product_of(from_far, to_near), length = product_of(to_near, to_near); // an alpha follows the colours
    if (!(along > 0.0f && length < INFINITY))
        return false;
    const float part = along / length;
    float beside[3];
    for (int k = 0; k < 3; ++k)
        beside[k] = fma(-part, to_near[k], from_far[k]);
    const float off = product_of(beside, beside);
    // A pixel that is brighter than the nearer surface shows a lamp behind it.
    const float is_lamp = is_of_lamp(near) * rising(fabs(e->nearest), 0.0f, STAYS_PX) * (1.0f - rising(part, 1.0f, 1.25f));
    of->part = taken * min(part, 1.0f) * blurred * (1.0f - rising(off / length, OFF_LINE, OFF_LINE_END)) *
               max(1.0f - rising(part, MOST_PART, MOST_PART_END), is_lamp);
    if (!(of->part > 0.0f))
        return false;
    split_color(here, near, far, of);
    return true;
}

// Is a sharp nearer surface so narrow, as a strand is, that it does not fill three by three pixels beyond the edge? `way` is null
// where none leads across.
INLINE bool is_sharp_strand(__global const float* planes, const blur_params* p, int column, int row, const edge_at* e,
                            const across_edge* way) {
    if (!way || !is_sharp(e))
        return is_sharp(e);
    const edge_at beyond = edge_around(planes, p, column - way->two_x, row - way->two_y);
    return !(fabs(beyond.nearest - e->nearest) < way->alike && fabs(beyond.farthest - e->nearest) < way->alike);
}

// The mean colour of the farther surface around a pixel, from pixels that no edge is beside. None where there are few, or where they
// differ by much of the way to another colour.
INLINE bool find_plain(__global const float* planes, __global const ELEMENT_TYPE* color, const grid_params* grid,
                       const blur_params* p, int column, int row, const edge_at* e, const float* other, float* plain) {
    const float alike = max(EDGE_PX, 0.5f * (e->farthest - e->nearest));
    float least[CHANNELS], most[CHANNELS], count = 0.0f, spread[3], way[3];
    for (int k = 0; k < CHANNELS; ++k) {
        least[k] = INFINITY;
        most[k] = -INFINITY;
        plain[k] = 0.0f;
    }
    for (int n = 0; n < 8 * PLAIN_STEPS; ++n) {
        const int way_of = n % 8 < 4 ? n % 8 : n % 8 + 1, far = 2 + n / 8 * 2;
        const int x = column + far * (way_of % 3 - 1), y = row + far * (way_of / 3 - 1);
        const edge_at beside = edge_around(planes, p, x, y);
        if (beside.side != 0 || !(fabs(beside.excess[HERE] - e->farthest) < alike))
            continue;
        float one[CHANNELS];
        color_at(color, grid, p, x, y, one);
        count += 1.0f;
        for (int k = 0; k < CHANNELS; ++k) {
            least[k] = min(least[k], one[k]);
            most[k] = max(most[k], one[k]);
            plain[k] += one[k];
        }
    }
    if (count < PLAIN_PIXELS)
        return false;
    for (int k = 0; k < CHANNELS; ++k) {
        plain[k] /= count;
        if (k < 3) {
            spread[k] = most[k] - least[k];
            way[k] = other[k] - plain[k];
        }
    }
    return product_of(spread, spread) < PLAIN * product_of(way, way);
}

// A pixel beside a strand's own: none of these says what a strand alone looks like, and how much of the pixel it covers. Before a
// plain background the pixel's own colour tells what of it is the strand's. Is there any?
INLINE bool keep_strand(__global const float* planes, __global const ELEMENT_TYPE* color, const grid_params* grid,
                        const blur_params* p, int column, int row, const edge_at* e, fragments* of) {
    const float middle = 0.5f * (e->nearest + e->farthest);
    float here[CHANNELS], strand[CHANNELS], one[CHANNELS], far[CHANNELS], own[3], way[3], count = 0.0f;
    for (int k = 0; k < CHANNELS; ++k)
        strand[k] = 0.0f;
    for (int n = 0; n < 9; ++n)
        if (e->excess[n] <= middle) {
            color_at(color, grid, p, column + n % 3 - 1, row + n / 3 - 1, one);
            count += 1.0f;
            for (int k = 0; k < CHANNELS; ++k)
                strand[k] += one[k];
        }
    for (int k = 0; k < CHANNELS; ++k)
        strand[k] /= count;
    if (!find_plain(planes, color, grid, p, column, row, e, strand, far))
        return false;
    color_at(color, grid, p, column, row, here);
    const float dark = 1.0f - max(is_of_lamp(here), is_of_lamp(strand)); // a lamp behind is none of the strand's
    for (int k = 0; k < 3; ++k) {
        own[k] = here[k] - far[k];
        way[k] = strand[k] - far[k];
    }
    const float along = product_of(own, way), length = product_of(way, way), part = along / length;
    if (!(along > 0.0f && length < INFINITY))
        return false;
    for (int k = 0; k < 3; ++k)
        own[k] = fma(-part, way[k], own[k]);
    const float off = product_of(own, own) / length, sharp = 1.0f - rising(fabs(e->nearest), 0.0f, STAYS_PX);
    of->part = dark * sharp * min(part, 1.0f) * rising(part, LEAST_STRAND, MOST_STRAND) *
               (1.0f - rising(off, OFF_LINE, OFF_LINE_END)) * (1.0f - rising(part, BEYOND_STRAND, BEYOND_STRAND_END));
    if (!(of->part > 0.0f))
        return false;
    split_color(here, strand, far, of);
    return true;
}

#endif
