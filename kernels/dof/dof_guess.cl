// What may lie behind a pixel's surface, as dof_behind.cl finds it, but only a few pixels away and eight pixels at once: the
// nearest pixel on the screen that is farther from the lens, and the nearest of those that nothing lies before.
// Built for: CLEAN_PLATE = 0 1

#include "dof/behind.h"

#define SIDE dof_behind_block

#ifndef CLEAN_PLATE
#error "CLEAN_PLATE is not defined: 1 where some pixels have what lies behind them already, 0 otherwise"
#endif

// The place that many steps from here: one more on either side in turn.
INLINE int in_turn(int step) {
    return step % 2 ? -(step + 1) / 2 : step / 2;
}

INLINE float least_of_8(float8 v) {
    const float4 four = min(v.lo, v.hi);
    return min(min(four.x, four.y), min(four.z, four.w));
}

INLINE float greatest_of_8(float8 v) {
    return -least_of_8(-v);
}

// The farthest layer of the blocks around one.
INLINE float farthest_around(__global const float* blocks, const behind_params* b, int column, int row) {
    const int aside = ((int)b->most + SIDE - 1) / SIDE, above = ((int)(b->most / b->vertical) + SIDE - 1) / SIDE;
    float farthest = NOWHERE;
    for (int y = max(row - above, 0); y <= min(row + above, (int)b->block_rows - 1); ++y)
        for (int x = max(column - aside, 0); x <= min(column + aside, (int)b->block_columns - 1); ++x)
            farthest = max(farthest, blocks[y * (int)b->block_columns + x]);
    return farthest;
}

// How far a guess lies away at most: a quarter of what a ray moves from beside a surface to behind it, and a pixel.
INLINE float8 reach_of(float8 farther, float8 circle) {
    return max(farther - circle, 0.0f) * 0.125f + 1.0f;
}

KERNEL void dof_guess(__global float* planes, __global const float* inner, __global const float* blocks,
                        const blur_params p, const behind_params b) {
    const int block_column = (int)get_global_id(0) - dof_margin / SIDE, block_row = get_global_id(1);
    if (!b.block_columns || block_column >= (int)b.block_columns + dof_margin / SIDE)
        return;
    float farthest = NOWHERE;
    if (block_column >= 0 && block_column < (int)b.block_columns)
        farthest = farthest_around(blocks + 2 * b.block_columns * b.block_rows, &b, block_column, block_row);
    const float8 circle_of_farthest = excess_of(farthest, &p);
    const int aside = (int)b.most, above = (int)(b.most / b.vertical), stride = (int)p.stride;
    for (int j = 0; j < SIDE; ++j) {
        const int row = SIDE * block_row + j;
        const size_t first = (size_t)row * p.stride + dof_margin + SIDE * block_column;
        __global const float* here = planes + first;
        __global float* second = planes + (1 + CHANNELS) * p.plane + first;
        const float8 layer = *(__global const float8_anywhere*)here;
        int8 hides = (layer >= 0.0f) & (HIDES(layer, &p) > 0.0f) & (farthest > layer + JUMP);
#if CLEAN_PLATE
        const int8 open = *(__global const float8_anywhere*)second < 0.0f;
        hides &= open;
#else
        for (uint k = 0; k <= CHANNELS; ++k)
            *(__global float8_anywhere*)(second + k * p.plane) = k > 0 ? 0.0f : NOWHERE;
#endif
        if (!any_of_8(hides))
            continue;
        const float8 circle = excess_of_8(layer, &p);
        const float8 farthest_reach = min(reach_of(circle_of_farthest, circle), b.most);
        float8 to_border = select((float8)(-1.0f), farthest_reach * farthest_reach, hides), to_inside = to_border;
        int8 border = 0, inside = 0;
        float most = greatest_of_8(to_inside);
        for (int step_y = 0; step_y <= 2 * above; ++step_y) {
            const int y = in_turn(step_y);
            const float square_y = (float)(y * y) * b.vertical * b.vertical;
            if (square_y > most)
                break;
            if (row + y < 0 || row + y >= (int)p.rows)
                continue;
            for (int step_x = 0; step_x <= 2 * aside; ++step_x) {
                const int x = in_turn(step_x), away = y * stride + x;
                const float square = (float)(x * x) + square_y;
                if (square > most)
                    break;
                const float8 its = *(__global const float8_anywhere*)(here + away);
                int8 nearer = (its > layer + JUMP) & (square < to_inside);
                if (!any_of_8(nearer))
                    continue;
                const float8 reach = reach_of(excess_of_8(its, &p), circle);
                nearer &= square <= reach * reach;
                const int8 at_border = nearer & (square < to_border);
                to_border = select(to_border, (float8)(square), at_border);
                border = select(border, (int8)(away), at_border);
                const int8 is_inside = nearer & (*(__global const float8_anywhere*)(inner + first + away) >= 0.0f);
                to_inside = select(to_inside, (float8)(square), is_inside);
                inside = select(inside, (int8)(away), is_inside);
                most = greatest_of_8(to_inside);
            }
        }
        for (int i = 0; i < SIDE; ++i) {
            const int to = ((const int*)&border)[i], farther_in = ((const int*)&inside)[i];
            const size_t at = first + i;
            if (to != 0)
                put_behind(planes, &p, at, (size_t)((long)at + to), (size_t)((long)at + (farther_in ? farther_in : to)),
                           GUESSED);
        }
    }
}
