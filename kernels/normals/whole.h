// The plane of least squares through all pixels of a window of radius 3, by lines through its rows: the pixels below each other
// share those. Rows are evenly spaced, so that the plane's slope across is the mean of theirs, and down it is that of their means.

#ifndef FATHOM_WHOLE_H
#define FATHOM_WHOLE_H

#include "camera/window.h"

#define WHOLE_RADIUS 3 // no more than depth_margin_rows

// A plane about the pixel: its inverse depth there, and its slopes.
typedef struct {
    floatV q, gx, gy;
} plane;

// The line of least squares through the seven pixels of a row about the pixel's column, and how far the worst lies off it.
typedef struct {
    floatV mean, slope, off;
} line;

// Twice the mean and the slope of seven numbers that are evenly spaced, from the middle one, and the sums and differences of the
// pairs about it, nearest first.
#define TWICE_MEAN(middle, sum1, sum2, sum3) ((2.0f / 7.0f) * ((sum1 + sum2) + (sum3 + middle)))
#define TWICE_SLOPE(rise1, rise2, rise3)                                                                               \
    ((2.0f / 28.0f) * fma((floatV)3.0f, rise3, fma((floatV)2.0f, rise2, rise1)))
// Twice how far the worse one of the i-th pair lies off such a line.
#define TWICE_OFF(i, sum, rise, mean, slope) (fabs(sum - mean) + fabs(fma((floatV)-(i), slope, rise)))

INLINE line line_of_row(const window* w, int row) {
    const floatV middle = neighbour(w, 0, row);
    floatV sum[WHOLE_RADIUS], rise[WHOLE_RADIUS];
#pragma unroll
    for (int i = 0; i < WHOLE_RADIUS; ++i) {
        const floatV after = neighbour(w, i + 1, row), before = neighbour(w, -i - 1, row);
        sum[i] = after + before;
        rise[i] = after - before;
    }
    const floatV mean = TWICE_MEAN(middle, sum[0], sum[1], sum[2]), slope = TWICE_SLOPE(rise[0], rise[1], rise[2]);
    floatV off = fabs(fma((floatV)2.0f, middle, -mean));
#pragma unroll
    for (int i = 0; i < WHOLE_RADIUS; ++i)
        off = max(off, TWICE_OFF(i + 1, sum[i], rise[i], mean, slope));
    return (line){0.5f * mean, 0.5f * slope, 0.5f * off};
}

// The plane of least squares through all pixels of the window, from the lines through its rows, and whether none of them lies
// farther off than `margin`. A pixel that is NaN makes all of it NaN.
INLINE intV whole_plane(const line* rows, floatV margin, plane* p) {
    floatV sum[WHOLE_RADIUS], rise[WHOLE_RADIUS], gx = rows[WHOLE_RADIUS].slope;
    const line middle = rows[WHOLE_RADIUS];
#pragma unroll
    for (int i = 0; i < WHOLE_RADIUS; ++i) {
        const line below = rows[WHOLE_RADIUS + i + 1], above = rows[WHOLE_RADIUS - i - 1];
        sum[i] = below.mean + above.mean;
        rise[i] = below.mean - above.mean;
        gx += below.slope + above.slope;
    }
    gx *= 1.0f / 7.0f;
    const floatV mean = TWICE_MEAN(middle.mean, sum[0], sum[1], sum[2]), slope = TWICE_SLOPE(rise[0], rise[1], rise[2]);
    const floatV reach = (floatV)(float)WHOLE_RADIUS;
    floatV worst = fma(reach, fabs(middle.slope - gx), fabs(fma((floatV)-0.5f, mean, middle.mean)) + middle.off);
#pragma unroll
    for (int i = 0; i < WHOLE_RADIUS; ++i) {
        const line below = rows[WHOLE_RADIUS + i + 1], above = rows[WHOLE_RADIUS - i - 1];
        const floatV turn = max(fabs(below.slope - gx), fabs(above.slope - gx));
        const floatV off = fma((floatV)0.5f, TWICE_OFF(i + 1, sum[i], rise[i], mean, slope), max(below.off, above.off));
        worst = max(worst, fma(reach, turn, off));
    }
    *p = (plane){0.5f * mean, gx, 0.5f * slope};
    return worst <= margin;
}

#endif
