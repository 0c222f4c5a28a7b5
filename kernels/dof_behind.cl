// What lies behind a pixel's surface: the nearest pixel on the screen that is farther from the lens, with its layer and colour.
// Only what a ray can reach: from beside a surface of circle c to behind it, at circle d, a ray of the lens moves by (d - c)/2
// pixels at most. What slopes away slower than that hides nothing.
// The colour of a pixel beside something nearer may be mixed with that: it is if it lies between that and a pixel farther in. Then
// the nearest pixel farther in is taken, with a part of the border's colour: an eighth has the least error over the seven
// scenes of bench/views.hpp.
// Exact, block by block, so that a region agrees with the whole.
// Built for: CLEAN_PLATE = 0 1

#include "tiles.h"

#define SIDE dof_behind_block
#define OF_BORDER 0.125f

#ifndef CLEAN_PLATE
#error "CLEAN_PLATE is not defined: 1 where some pixels have what lies behind them already, 0 otherwise"
#endif

// Where the nearest pixel is whose layer in `layers` lies behind this one; `at` where there is none.
INLINE size_t nearest_behind(__global const float* layers, __global const float* blocks, const blur_params* p,
                             const behind_params* b, int column, int row, size_t at, float layer) {
    const float circle = circle_of(layer, p);
    const float most = (circle_of(b->farthest, p) - circle) * 0.5f + 1.0f;
    const int left = max(column - (int)most, 0) / SIDE, right = min(column + (int)most, (int)p->columns - 1) / SIDE;
    const int high = (int)(most / b->vertical);
    const int top = max(row - high, 0) / SIDE, bottom = min(row + high, (int)p->rows - 1) / SIDE;
    size_t found = at;
    float nearest = INFINITY;
    for (int y = top; y <= bottom; ++y) {
        for (int x = left; x <= right; ++x) {
            const float farthest = blocks[y * (int)b->block_columns + x];
            if (!(farthest > layer + JUMP))
                continue;
            const float away_x = (float)max(max(SIDE * x - column, column - SIDE * x - (SIDE - 1)), 0);
            const float away_y = (float)max(max(SIDE * y - row, row - SIDE * y - (SIDE - 1)), 0) * b->vertical;
            const float away = fma(away_x, away_x, away_y * away_y);
            const float reach = (circle_of(farthest, p) - circle) * 0.5f + 1.0f;
            if (away > nearest || away > reach * reach)
                continue;
            for (int i = 0; i < SIDE * SIDE; ++i) {
                const int other_column = SIDE * x + i % SIDE, other_row = SIDE * y + i / SIDE;
                const size_t other = (size_t)other_row * p->stride + dof_margin + other_column;
                const float dx = (float)(other_column - column), dy = (float)(other_row - row) * b->vertical;
                const float square = fma(dx, dx, dy * dy);
                const float its = layers[other];
                if (!(its > layer + JUMP) || square > nearest || (square == nearest && other >= found))
                    continue;
                const float its_reach = (circle_of(its, p) - circle) * 0.5f + 1.0f;
                if (square <= its_reach * its_reach) {
                    nearest = square;
                    found = other;
                }
            }
        }
    }
    return found;
}

// Is a pixel's colour between those of the nearest surface beside it and of a pixel farther in?
INLINE bool mixed(__global const float* planes, const blur_params* p, size_t border, size_t inside) {
    const int row = (int)(border / p->stride);
    size_t nearest = border;
    for (int j = row > 0 ? -1 : 0; j <= (row + 1 < (int)p->rows ? 1 : 0); ++j) {
        for (int i = -1; i <= 1; ++i) {
            const size_t other = (size_t)((long)border + j * (long)p->stride + i);
            if (planes[other] >= 0.0f && planes[other] < planes[nearest])
                nearest = other;
        }
    }
    for (uint k = 1; k <= CHANNELS; ++k) {
        const float here = planes[k * p->plane + border], one = planes[k * p->plane + nearest],
                    other = planes[k * p->plane + inside];
        if (here < min(one, other) || here > max(one, other))
            return false;
    }
    return true;
}

__kernel void dof_behind(__global float* planes, __global const float* inner, __global const float* blocks,
                         const blur_params p, const behind_params b) {
    const int column = (int)get_global_id(0) - dof_margin, row = get_global_id(1);
    if (column >= (int)p.columns + dof_margin)
        return;
    __global float* second = planes + (1 + CHANNELS) * p.plane;
    const size_t at = (size_t)row * p.stride + dof_margin + column;
#if CLEAN_PLATE
    if (second[at] >= 0.0f)
        return;
#endif
    const float layer = planes[at];
    size_t border = at, found = at;
    if (column >= 0 && column < (int)p.columns && layer >= 0.0f && b.farthest > layer + JUMP) {
        border = nearest_behind(planes, blocks + b.block_columns * b.block_rows, &p, &b, column, row, at, layer);
        if (border != at)
            found = nearest_behind(inner, blocks, &p, &b, column, row, at, layer);
        if (found == at || !mixed(planes, &p, border, found))
            found = border;
    }
    second[at] = found == at ? NOWHERE : planes[found];
    for (uint k = 1; k <= CHANNELS; ++k) {
        const float color = fma(OF_BORDER, planes[k * p.plane + border] - planes[k * p.plane + found],
                                planes[k * p.plane + found]);
        second[k * p.plane + at] = found == at ? 0.0f : color;
    }
}
