// What lies behind a pixel's surface: the nearest pixel on the screen that is farther from the lens, with its layer and colour.
// Only what a ray can reach: from beside a surface of circle c to behind it, at circle d, a ray of the lens moves by (d - c)/2
// pixels at most. What slopes away slower than that hides nothing.
// Exact, block by block, so that a region agrees with the whole.
// Built for: CLEAN_PLATE = 0 1

#include "dof/behind.h"

#define SIDE dof_behind_block

#ifndef CLEAN_PLATE
#error "CLEAN_PLATE is not defined: 1 where some pixels have what lies behind them already, 0 otherwise"
#endif

// A range of blocks.
typedef struct {
    int left, right, top, bottom;
} block_range;

// circle_of for pixels with a layer.
INLINE float8 circle_of_8(float8 layers, const blur_params* p) {
    const float8 away = fabs(layers - (float)p->middle) / p->per_octave, octave = floor(away);
    const float8 power = as_float8((convert_int8(octave) + 127) << 23);
    const float8 size = select((float8)0.0f, power * (1.0f + (away - octave)), away > 0.0f);
    return select(size, -size, layers < (float)p->middle);
}

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
    const int first = max(column - aside, 0), last = min(column + aside, (int)b->block_columns - 1);
    for (int y = max(row - above, 0); y <= min(row + above, (int)b->block_rows - 1); ++y) {
        const float away_y = (float)max(SIDE * (int)abs(y - row) - (SIDE - 1), 0) * b->vertical;
        for (int x = first; x <= last; x += 8) {
            __global const float* block = blocks + y * (int)b->block_columns + x;
            const int8 columns = x + (int8)(0, 1, 2, 3, 4, 5, 6, 7);
            int8 some = (columns <= last) & (*(__global const float8_anywhere*)block > least + JUMP);
            if (!any_of_8(some))
                continue;
            // Two vectors: Oclgrind reads a number beside one as if it were one.
            const float8 away_x =
                convert_float8(max(SIDE * max(columns - column, column - columns) - (SIDE - 1), (int8)0));
            const float8 circles = *(__global const float8_anywhere*)(block + b->block_columns * b->block_rows);
            const float8 reach = (circles - circle) * 0.5f + 1.0f;
            some &= fma(away_x, away_x, (float8)(away_y * away_y)) <= reach * reach;
            if (!any_of_8(some))
                continue;
            for (int i = 0; i < 8; ++i)
                if (((const int*)&some)[i]) {
                    found.left = min(found.left, x + i);
                    found.right = max(found.right, x + i);
                }
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

// Rounded up; for a bound that must not be too small.
INLINE int at_most(float distance) {
    return (int)min(distance, 1e4f) + 1;
}

// Where the nearest pixel is whose layer in `layers` lies behind this one, and of two the one that comes first; `at` where there
// is none. The nearest blocks come first. `likely` bounds what is looked at if it is such a pixel, and changes no result.
INLINE size_t nearest_behind(__global const float* layers, __global const float* blocks, const blur_params* p,
                             const behind_params* b, const block_range* within, int column, int row, size_t at,
                             float layer, float circle, size_t likely) {
    const int middle_x = column / SIDE, middle_y = row / SIDE;
    int left = within->left, right = within->right, top = within->top, bottom = within->bottom;
    size_t found = at;
    float nearest = INFINITY;
    if (layers[likely] > layer + JUMP) {
        const float dx = (float)((int)(likely % p->stride) - (int)dof_margin - column);
        const float dy = (float)((int)(likely / p->stride) - row) * b->vertical;
        const float square = fma(dx, dx, dy * dy), reach = reach_of(circle_of(layers[likely], p), circle);
        if (square <= reach * reach) {
            nearest = square;
            found = likely;
            const float away = sqrt(square);
            const int aside = at_most(away), above = at_most(away / b->vertical);
            left = max(left, max(column - aside, 0) / SIDE);
            right = min(right, (column + aside) / SIDE);
            top = max(top, max(row - above, 0) / SIDE);
            bottom = min(bottom, (row + above) / SIDE);
        }
    }
    // Eight blocks of a row are looked at together.
    const int eights = (right - left) / 8, middle_eight = min(max(middle_x - left, 0) / 8, eights);
    const int steps_x = 2 * max(middle_eight, eights - middle_eight),
              steps_y = 2 * max(middle_y - top, bottom - middle_y);
    for (int step_y = 0; step_y <= steps_y; ++step_y) {
        const int y = in_turn(middle_y, step_y);
        if (y < top || y > bottom)
            continue;
        const float away_y = (float)max(max(SIDE * y - row, row - SIDE * y - (SIDE - 1)), 0) * b->vertical;
        if (away_y * away_y > nearest)
            continue;
        for (int step_x = 0; step_x <= steps_x; ++step_x) {
            const int eight = in_turn(middle_eight, step_x);
            if (eight < 0 || eight > eights)
                continue;
            const int first = left + 8 * eight;
            __global const float* block = blocks + y * (int)b->block_columns + first;
            const int8 columns = first + (int8)(0, 1, 2, 3, 4, 5, 6, 7);
            int8 some = (columns <= right) & (*(__global const float8_anywhere*)block > layer + JUMP);
            if (!any_of_8(some))
                continue;
            const float8 reach =
                (*(__global const float8_anywhere*)(block + b->block_columns * b->block_rows) - circle) * 0.5f + 1.0f;
            const float8 away_x =
                convert_float8(max(max(SIDE * columns - column, column - SIDE * columns - (SIDE - 1)), (int8)0));
            const float8 away = fma(away_x, away_x, (float8)(away_y * away_y));
            some &= (away <= nearest) & (away <= reach * reach);
            if (!any_of_8(some))
                continue;
            for (int n = 0; n < 8; ++n) {
                if (!((const int*)&some)[n] || ((const float*)&away)[n] > nearest)
                    continue;
                const int x = first + n;
                const float most = ((const float*)&reach)[n] * ((const float*)&reach)[n];
                for (int j = 0; j < SIDE; ++j) {
                    const int other_row = SIDE * y + j;
                    const size_t others = (size_t)other_row * p->stride + dof_margin + SIDE * x;
                    const float dy = (float)(other_row - row) * b->vertical;
                    const float8 dx = (float8)((float)(SIDE * x - column)) + (float8)(0, 1, 2, 3, 4, 5, 6, 7);
                    const float8 squares = fma(dx, dx, (float8)(dy * dy));
                    const float8 all = *(__global const float8_anywhere*)(layers + others);
                    int8 behind = (all > layer + JUMP) & (squares <= min(nearest, most));
                    if (!any_of_8(behind))
                        continue;
                    const float8 its_reach = (circle_of_8(all, p) - circle) * 0.5f + 1.0f;
                    behind &= squares <= its_reach * its_reach;
                    if (!any_of_8(behind))
                        continue;
                    for (int i = 0; i < SIDE; ++i) {
                        const size_t other = others + i;
                        const float square = ((const float*)&squares)[i];
                        if (((const int*)&behind)[i] && (square < nearest || (square == nearest && other < found))) {
                            nearest = square;
                            found = other;
                        }
                    }
                }
            }
        }
    }
    return found;
}

KERNEL void dof_behind(__global float* planes, __global const float* inner, __global const float* blocks,
                       const blur_params p, const behind_params b) {
    const int block_column = (int)get_global_id(0) - dof_margin / SIDE, block_row = get_global_id(1);
    if (!b.block_columns || block_column >= (int)b.block_columns + dof_margin / SIDE)
        return;
    __global float* second = planes + (1 + CHANNELS) * p.plane;
    const size_t first = (size_t)(SIDE * block_row) * p.stride + dof_margin + SIDE * block_column;
    block_range within = {0, -1, 0, -1};
    if (block_column >= 0 && block_column < (int)b.block_columns) {
        float least = INFINITY;
        float8 all = INFINITY;
        for (int j = 0; j < SIDE; ++j) {
            const float8 layers = *(__global const float8_anywhere*)(planes + first + (size_t)j * p.stride);
            all = select(all, min(all, layers), layers >= 0.0f);
        }
        const float4 four = min(all.lo, all.hi);
        least = min(min(four.x, four.y), min(four.z, four.w));
        if (b.farthest > least + JUMP)
            within = blocks_behind(blocks + 2 * b.block_columns * b.block_rows, &p, &b, block_column, block_row, least);
    }
#if !CLEAN_PLATE
    if (within.left > within.right) {
        for (int j = 0; j < SIDE; ++j)
            for (uint k = 0; k <= CHANNELS; ++k)
                *(__global float8_anywhere*)(second + k * p.plane + first + (size_t)j * p.stride) =
                    k > 0 ? 0.0f : NOWHERE;
        return;
    }
#endif
    size_t likely_border = first, likely_inside = first; // what the pixel before has found
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
            const float circle = circle_of(layer, &p);
            border = nearest_behind(planes, blocks + 2 * b.block_columns * b.block_rows, &p, &b, &within, column, row,
                                    at, layer, circle, likely_border);
            likely_border = border != at ? border : likely_border;
            if (border != at && inner[border] >= 0.0f)
                found = border;
            else if (border != at)
                found = nearest_behind(inner, blocks, &p, &b, &within, column, row, at, layer, circle, likely_inside);
            likely_inside = found != at ? found : likely_inside;
            if (found == at)
                found = border;
        }
        put_behind(planes, &p, at, border, found, 0.0f);
    }
}
