// Two colours of one pixel. A picture is antialiased, and depth is a point sample: a pixel beside an edge in depth has a part of
// the surface behind that edge, or before it, which lies in other fog than its own.
//   C = A + t (B - A),  A one pixel away from the edge, B one or two pixels beyond it, t the part by least squares
// The pixel is then two fragments, of area 1 - t and t, whose colours' mean is C. Each lies between C and the colour on its side,
// so that neither has a colour that no pixel has. Where C is not on the line from A to B, the pixel has one colour.
// The pixel beyond the edge bounds t: a straight edge that leaves a part u of that pixel to this side leaves this pixel at most
// (sqrt(1/2) - sqrt(u))^2, which is exact for an edge at 45 degrees, and less for one along a row or a column. So a texture is
// seldom taken for an edge. Where the colours on this side are more even than on that one, u says less than t does.

#ifndef FATHOM_TWO_COLORS_H
#define FATHOM_TWO_COLORS_H

#include "edge.h"
#include "pixels.h"

#define OFF_LINE 0.01f     // squared, of the distance from A to B: up to this a colour lies on the line;
#define OFF_LINE_END 0.04f // from this on it does not
#define MOST_PART 0.5f     // what a straight edge leaves to the surface that does not hold a pixel's centre,
#define MOST_PART_END 0.8f // and what no edge does
#define COUNTED (PREMULTIPLIED ? CHANNELS : 3) // channels that add up
#define AROUND 5                               // pixels across what is looked at around one
#define ROW (V + AROUND - 1)                   // and around V pixels
#define HERE (2 * ROW + 2)                     // the first of these

// The fog's part of the pixels around one, in rows of ROW of which 5 count, NaN where there is no depth, and their colours in the
// image.
typedef struct {
    const float* fog;
    __global const ELEMENT_TYPE* color;
    size_t first; // element of the image
    uint stride;  // in elements
    uint x, y;    // of the pixel in the middle
    uint width, height;
} pixels_around;

INLINE void color_around(const pixels_around* p, int at, float* value) {
    const int x = clamp((int)p->x + at % ROW - 2, 0, (int)p->width - 1);
    const int y = clamp((int)p->y + at / ROW - 2, 0, (int)p->height - 1);
    const size_t element = p->first + (size_t)y * p->stride + (size_t)(CHANNELS * x);
    for (int k = 0; k < CHANNELS; ++k)
        value[k] = read_element(p->color, element + k);
}

INLINE bool is_around(int column, int row) {
    return column >= 0 && column < AROUND && row >= 0 && row < AROUND;
}

// Which side of an edge: -1, 1, or 0 where there is no depth.
INLINE int side_of(float fog, float middle) {
    return (fog > middle) - (fog <= middle);
}

// A pixel's part of the other side of an edge.
typedef struct {
    float part;
    float uneven;   // how much the colours of its own side differ, squared, of the distance to the other side's
    int own, other; // pixels whose colours are those of both sides
    int beside;     // the pixel beyond the edge
    bool along;     // does the edge lie along a row or a column?
} other_side;

// Squares and products of colours: the same for red first and blue first. A black object before nothing differs from it by alpha.
INLINE float product_of(const float* a, const float* b) {
    const float product = fma(a[1], b[1], a[0] * b[0] + a[2] * b[2]);
    return COUNTED == 4 ? fma(a[COUNTED - 1], b[COUNTED - 1], product) : product;
}

INLINE void difference(const float* a, const float* b, float* of) {
    for (int k = 0; k < COUNTED; ++k)
        of[k] = a[k] - b[k];
}

INLINE other_side look_across(const pixels_around* p, int at, float middle) {
    const int column = at % ROW, row = at / ROW, side = side_of(p->fog[at], middle);
    other_side found = {0.0f, 0.0f, at, at, at, false};
    int across = 0, down = 0; // from the other side to the pixel's own
    for (int n = 0; n < 9; ++n) {
        const int dx = n % 3 - 1, dy = n / 3 - 1;
        const int towards = is_around(column + dx, row + dy) ? side * side_of(p->fog[at + ROW * dy + dx], middle) : 0;
        across += towards * dx;
        down += towards * dy;
    }
    if ((across == 0 && down == 0) || side == 0)
        return found;
    const edge_way way = way_from_edge(across, down);
    const int one_x = way.one_x, one_y = way.one_y, two_x = way.two_x, two_y = way.two_y;
    const int own = at + ROW * one_y + one_x, beside = at - ROW * one_y - one_x;
    const bool is_deep =
        is_around(column - two_x, row - two_y) && side_of(p->fog[at - ROW * two_y - two_x], middle) == -side;
    const bool is_beside = is_around(column - one_x, row - one_y) && side_of(p->fog[beside], middle) == -side;
    if (!is_around(column + one_x, row + one_y) || side_of(p->fog[own], middle) != side || !(is_deep || is_beside))
        return found;
    found.own = own;
    found.other = found.beside = is_beside ? beside : at;
    found.along = way.along;
    float here[CHANNELS], one[CHANNELS], other[CHANNELS], off[COUNTED], to_other[COUNTED], length = 0.0f,
                                                                                           least_off = INFINITY;
    color_around(p, at, here);
    color_around(p, own, one);
    for (int i = 0; i < 2; ++i) { // that which is nearer to a line with both others
        if (!(i == 0 ? is_deep : is_beside))
            continue;
        const int candidate = i == 0 ? at - ROW * two_y - two_x : beside;
        color_around(p, candidate, other);
        difference(here, one, off);
        difference(other, one, to_other);
        const float along = product_of(off, to_other), square = product_of(to_other, to_other);
        if (!(along > 0.0f && square < INFINITY))
            continue;
        const float part = along / square;
        for (int k = 0; k < COUNTED; ++k)
            off[k] = fma(-part, to_other[k], off[k]);
        const float beside_line = product_of(off, off) / square;
        if (!(beside_line < least_off))
            continue;
        least_off = beside_line;
        length = square;
        found.other = candidate;
        const float on_line = clamp((OFF_LINE_END - beside_line) / (OFF_LINE_END - OFF_LINE), 0.0f, 1.0f);
        const float is_part = clamp((MOST_PART_END - part) / (MOST_PART_END - MOST_PART), 0.0f, 1.0f);
        found.part = min(part, 1.0f) * on_line * is_part;
    }
    for (int turn = -1; turn <= 1 && least_off < INFINITY; turn += 2) { // along the edge, where it is known
        const int x = one_x - turn * one_y, y = one_y + turn * one_x;
        if (!is_around(column + x, row + y))
            continue;
        color_around(p, at + ROW * y + x, other);
        difference(other, one, off);
        const bool is_own = side_of(p->fog[at + ROW * y + x], middle) == side;
        found.uneven = max(found.uneven, is_own ? product_of(off, off) / length : 1.0f);
    }
    return found;
}

// The other side's part of the pixel in the middle, if it lies at an edge.
INLINE other_side look_around(const pixels_around* p) {
    float least = INFINITY, greatest = -INFINITY;
    for (int n = 0; n < 9; ++n) {
        const float fog = p->fog[HERE + ROW * (n / 3 - 1) + n % 3 - 1];
        least = fmin(least, fog);
        greatest = fmax(greatest, fog);
    }
    const float middle = 0.5f * (least + greatest);
    if (!((greatest - least) * fog_steps > 1.0f))
        return (other_side){0.0f, 0.0f, HERE, HERE, HERE, false};
    other_side found = look_across(p, HERE, middle);
    if (found.part > 0.0f && found.beside != HERE) {
        const other_side beyond = look_across(p, found.beside, middle);
        if (beyond.uneven <= found.uneven) {
            const float most = max(0.70710678f - (beyond.along ? 1.41421356f : 1.0f) * sqrt(beyond.part), 0.0f);
            found.part = min(found.part, most * most);
        }
    }
    return found;
}

#endif
