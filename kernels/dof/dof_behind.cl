// What lies behind a pixel's surface: the nearest pixel on the screen that is farther from the lens, with its layer and colour.
// Only what a ray can reach: from beside a surface of circle c to behind it, at circle d, a ray of the lens moves by (d - c)/2
// pixels at most. What slopes away slower than that hides nothing.
// The colour of a pixel beside something nearer may be mixed with that: it is if it lies between that and a pixel farther in. Then
// the nearest pixel farther in is taken, with a part of the border's colour: an eighth has the least error over the seven
// scenes of bench/views.hpp.
// Exact, block by block, so that a region agrees with the whole.
// Built for: CLEAN_PLATE = 0 1

#include "dof/tiles.h"

#define SIDE dof_behind_block
#define OF_BORDER 0.125f

#ifndef CLEAN_PLATE
#error "CLEAN_PLATE is not defined: 1 where some pixels have what lies behind them already, 0 otherwise"
#endif

// SIDE pixels of a row.
typedef float8 __attribute__((aligned(4))) float8_anywhere;

// A range of blocks.
typedef struct {
    int left, right, top, bottom;
} block_range;

// How far a ray moves at most from beside a surface to behind it, at a farther circle.
INLINE float reach_of(float farther, float circle) {
    return (farther - circle) * 0.5f + 1.0f;
}

// The blocks that hold what any pixel of a block may find behind it; `least` is the nearest layer of these. Empty where left is
// greater than right.
INLINE block_range blocks_behind(__global const float* blocks, const blur_params* p, const behind_params* b, int column,
                                 int row, float least) {
    const float circle = circle_of(least, p), most = reach_of(circle_of(b->farthest, p), circle);
    const int aside = ((int)most + SIDE - 1) / SIDE, above = ((int)(most / b->vertical) + SIDE - 1) / SIDE;
    block_range found = {column + aside + 1, column - aside - 1, row + above + 1, row - above - 1};
    for (int y = max(row - above, 0); y <= min(row + above, (int)b->block_rows - 1); ++y) {
        for (int x = max(column - aside, 0); x <= min(column + aside, (int)b->block_columns - 1); ++x) {
            __global const float* block = blocks + y * (int)b->block_columns + x;
            if (!(*block > least + JUMP))
                continue;
            const float away_x = (float)max(SIDE * (int)abs(x - column) - (SIDE - 1), 0);
            const float away_y = (float)max(SIDE * (int)abs(y - row) - (SIDE - 1), 0) * b->vertical;
            const float reach = reach_of(block[b->block_columns * b->block_rows], circle);
            if (fma(away_x, away_x, away_y * away_y) > reach * reach)
                continue;
            found.left = min(found.left, x);
            found.right = max(found.right, x);
            found.top = min(found.top, y);
            found.bottom = max(found.bottom, y);
        }
    }
    return found;
}

// The place that many steps from the middle: one more on either side in turn.
INLINE int in_turn(int middle, int step) {
    return step % 2 ? middle - (step + 1) / 2 : middle + step / 2;
}

// Where the nearest pixel is whose layer in `layers` lies behind this one; `at` where there is none. The nearest blocks come
// first.
INLINE size_t nearest_behind(__global const float* layers, __global const float* blocks, const blur_params* p,
                             const behind_params* b, const block_range* within, int column, int row, size_t at,
                             float layer) {
    const float circle = circle_of(layer, p);
    const int middle_x = column / SIDE, middle_y = row / SIDE;
    const int steps_x = 2 * max(middle_x - within->left, within->right - middle_x),
              steps_y = 2 * max(middle_y - within->top, within->bottom - middle_y);
    size_t found = at;
    float nearest = INFINITY;
    for (int step_y = 0; step_y <= steps_y; ++step_y) {
        const int y = in_turn(middle_y, step_y);
        if (y < within->top || y > within->bottom)
            continue;
        const float away_y = (float)max(max(SIDE * y - row, row - SIDE * y - (SIDE - 1)), 0) * b->vertical;
        if (away_y * away_y > nearest)
            continue;
        for (int step_x = 0; step_x <= steps_x; ++step_x) {
            const int x = in_turn(middle_x, step_x);
            if (x < within->left || x > within->right)
                continue;
            __global const float* block = blocks + y * (int)b->block_columns + x;
            if (!(*block > layer + JUMP))
                continue;
            const float away_x = (float)max(max(SIDE * x - column, column - SIDE * x - (SIDE - 1)), 0);
            const float away = fma(away_x, away_x, away_y * away_y);
            const float reach = reach_of(block[b->block_columns * b->block_rows], circle);
            if (away > nearest || away > reach * reach)
                continue;
            for (int j = 0; j < SIDE; ++j) {
                const int other_row = SIDE * y + j;
                const size_t others = (size_t)other_row * p->stride + dof_margin + SIDE * x;
                const float dy = (float)(other_row - row) * b->vertical;
                const float8 dx = (float8)((float)(SIDE * x - column)) + (float8)(0, 1, 2, 3, 4, 5, 6, 7);
                const float8 squares = fma(dx, dx, (float8)(dy * dy));
                const float8 all = *(__global const float8_anywhere*)(layers + others);
                if (!any((all > layer + JUMP) & (squares <= min(nearest, reach * reach))))
                    continue;
                for (int i = 0; i < SIDE; ++i) {
                    const size_t other = others + i;
                    const float its = ((const float*)&all)[i], square = ((const float*)&squares)[i];
                    if (!(its > layer + JUMP) || square > min(nearest, reach * reach) ||
                        (square == nearest && other >= found))
                        continue;
                    const float its_reach = reach_of(circle_of(its, p), circle);
                    if (square <= its_reach * its_reach) {
                        nearest = square;
                        found = other;
                    }
                }
            }
        }
    }
    return found;
}

// How far a pixel beside something nearer is mixed with it: not at all where its colour is not between those of the nearest
// surface beside it and of a pixel farther in. What dof_inner.cl takes for inside changes at once, and this by and by.
INLINE float mixed(__global const float* planes, const blur_params* p, size_t border, size_t inside) {
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
            return 0.0f;
    }
    const float before = planes[nearest], layer = planes[border];
    return rising(layer - before, JUMP, JUMP + 1.0f) *
           rising(excess_of(layer, p) - excess_of(before, p), APART, APART + 1.0f);
}

KERNEL void dof_behind(__global float* planes, __global const float* inner, __global const float* blocks,
                         const blur_params p, const behind_params b) {
    const int block_column = (int)get_global_id(0) - dof_margin / SIDE, block_row = get_global_id(1);
    if (block_column >= (int)b.block_columns + dof_margin / SIDE)
        return;
    __global float* second = planes + (1 + CHANNELS) * p.plane;
    const size_t first = (size_t)(SIDE * block_row) * p.stride + dof_margin + SIDE * block_column;
    block_range within = {0, -1, 0, -1};
    if (block_column >= 0 && block_column < (int)b.block_columns) {
        float least = INFINITY;
        for (int i = 0; i < SIDE * SIDE; ++i) {
            const float layer = planes[first + (size_t)(i / SIDE) * p.stride + i % SIDE];
            least = layer >= 0.0f ? min(least, layer) : least;
        }
        if (b.farthest > least + JUMP)
            within = blocks_behind(blocks + 2 * b.block_columns * b.block_rows, &p, &b, block_column, block_row, least);
    }
    for (int i = 0; i < SIDE * SIDE; ++i) {
        const int column = SIDE * block_column + i % SIDE, row = SIDE * block_row + i / SIDE;
        const size_t at = first + (size_t)(i / SIDE) * p.stride + i % SIDE;
#if CLEAN_PLATE
        if (second[at] >= 0.0f)
            continue;
#endif
        const float layer = planes[at];
        size_t border = at, found = at;
        if (within.left <= within.right && layer >= 0.0f && b.farthest > layer + JUMP) {
            border = nearest_behind(planes, blocks + 2 * b.block_columns * b.block_rows, &p, &b, &within, column, row,
                                    at, layer);
            if (border != at)
                found = nearest_behind(inner, blocks, &p, &b, &within, column, row, at, layer);
            if (found == at)
                found = border;
        }
        const float part = found == border ? 0.0f : mixed(planes, &p, border, found);
        const float behind = fma(part, planes[found] - planes[border], planes[border]);
        second[at] = found == at ? NOWHERE : floor(fma(behind, 512.0f, 0.5f)) * 0x1p-9f; // as dof_planes.cl has layers
        for (uint k = 1; k <= CHANNELS; ++k) {
            const float own = planes[k * p.plane + border];
            const float color = fma((1.0f - OF_BORDER) * part, planes[k * p.plane + found] - own, own);
            second[k * p.plane + at] = found == at ? 0.0f : color;
        }
    }
}
