// Ways from a pixel beside an edge, and colours that lie between two others.

#ifndef FATHOM_EDGE_H
#define FATHOM_EDGE_H

#include "vector.h"

typedef struct {
    int sign_x, sign_y;
    int one_x, one_y; // a pixel away from the edge, along the nearest of 8 directions
    int two_x, two_y; // two pixels, along the nearest of 16
    bool along;       // does the edge lie along a row or a column?
} edge_way;

// `across` and `down`: sums of the steps from the other side to a pixel's own, over its eight neighbours. Not both are 0.
INLINE edge_way way_from_edge(int across, int down) {
    const int wide = abs(across), high = abs(down), most = max(wide, high), least = min(wide, high);
    const bool slants = 12 * least > 5 * most;
    const int side_step = 4 * least < most ? 0 : 8 * least < 7 * most ? 1 : 2;
    edge_way way;
    way.sign_x = (across > 0) - (across < 0);
    way.sign_y = (down > 0) - (down < 0);
    way.one_x = wide == most || slants ? way.sign_x : 0;
    way.one_y = high == most || slants ? way.sign_y : 0;
    way.two_x = way.sign_x * (wide == most ? 2 : side_step);
    way.two_y = way.sign_y * (high == most ? 2 : side_step);
    way.along = side_step == 0;
    return way;
}

INLINE float between(float value, float one, float other) {
    return min(max(value, min(one, other)), max(one, other));
}

#endif
