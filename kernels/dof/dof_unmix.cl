// Takes the fragment of a foreground out of the pixels beyond its edge, where an antialiased picture has mixed it in: see
// mixed.h. Its area goes with its light, so that a pixel's colour remains one that pixels have. Under u.gain, which is launched
// next, it joins the foreground's own pixel beside it, with which it is spread. Beside a sharp foreground it stays where it is,
// before all layers, so the layers have that much less of the lens there.

#include "dof/mixed.h"

// The nearest circle of three columns, or the farthest one.
INLINE floatV beside(__global const float* planes, const blur_params* p, size_t at, int row, bool farthest) {
    floatV found = farthest ? -INFINITY : INFINITY;
    if (row < 0 || row >= (int)p->rows)
        return found;
    for (int dx = -1; dx <= 1; ++dx) {
        const floatV one = LOAD(float, planes + (size_t)((long)at + dx));
        found = farthest ? max(found, one) : min(found, select((floatV)INFINITY, one, one >= 0.0f));
    }
    return found;
}

// One row of V pixels of a tile, of which `some` may lie beyond an edge, or before it under `gain`. Does anything move?
INLINE bool unmix(__global float* planes, __global const ELEMENT_TYPE* color, __global float* state,
                  const grid_params* grid, const blur_params* p, uint gain, int first, int row, intV some) {
    const size_t begin = in_planes(p, 0, (uint)first, (uint)row);
    const uint_lanes lanes = as_uintV(some);
    bool any = false;
    for (int i = 0; i < V; ++i) {
        if (!((const uint*)&lanes)[i])
            continue;
        const int column = first + i;
        const edge_at e = edge_around(planes, p, column, row);
        __global float* pixel = planes + begin + i;
        across_edge way;
        fragments of;
        float nearer_color[CHANNELS];
        if (gain) {
            color_at(color, grid, p, column, row, nearer_color);
            const fragment_parts parts = parts_of_fragment(&e, nearer_color);
            if (!(parts.moves > 0.0f))
                continue;
            const float taken = parts.moves + parts.stays;
            for (int n = 0; n < 9; ++n) {
                const int x = column + n % 3 - 1, y = row + n / 3 - 1;
                if (!(e.excess[n] > e.excess[HERE]) || planes[p->areas + in_planes(p, 0, (uint)x, (uint)y)] == 1.0f)
                    continue;
                const edge_at beyond = edge_around(planes, p, x, y);
                if (beyond.side <= 0 || !find_across(&beyond, &way) || x + way.to_x != column || y + way.to_y != row ||
                    (is_sharp_strand(planes, p, x, y, &beyond, &way) &&
                     keep_strand(planes, color, grid, p, x, y, &beyond, &of)) ||
                    !take_apart(planes, color, grid, p, x, y, &beyond, &way, taken, &of))
                    continue;
                const float joins = parts.moves / taken * of.part, area = pixel[p->areas] + joins;
                for (uint k = 0; k < CHANNELS; ++k) {
                    const float own = pixel[(k + 1) * p->plane];
                    pixel[(k + 1) * p->plane] = fma(joins / area, of.near[k] - own, own);
                }
                pixel[p->areas] = area;
            }
            continue;
        }
        if (e.side <= 0)
            continue;
        const bool is_found = find_across(&e, &way);
        float stays = 1.0f; // of what is taken
        if (!is_sharp_strand(planes, p, column, row, &e, is_found ? &way : 0) ||
            !keep_strand(planes, color, grid, p, column, row, &e, &of)) {
            if (!is_found)
                continue;
            const edge_at nearer = edge_around(planes, p, column + way.to_x, row + way.to_y);
            color_at(color, grid, p, column + way.to_x, row + way.to_y, nearer_color);
            const fragment_parts parts = parts_of_fragment(&nearer, nearer_color);
            const float taken = parts.moves + parts.stays;
            if (!take_apart(planes, color, grid, p, column, row, &e, &way, taken, &of))
                continue;
            any |= parts.moves > 0.0f;
            stays = parts.stays / taken;
        }
        for (uint k = 0; k < CHANNELS; ++k)
            pixel[(k + 1) * p->plane] = of.far[k];
        pixel[p->areas] = 1.0f - of.part;
        if (row < (int)p->state_row || (uint)row - p->state_row >= p->state_plane / p->stride)
            continue;
        const float rest = 1.0f - stays * of.part;
        __global float* laid = state + in_state(p, begin + i);
        laid[0] = rest;
        for (uint k = 0; k < CHANNELS; ++k)
            laid[(k + 1) * p->state_plane] = (1.0f - rest) * of.near[k];
    }
    return any;
}

KERNEL void dof_unmix(__global float* planes, __global const ELEMENT_TYPE* color, __global float* state,
                      __global uint* tiles, const grid_params grid, const blur_params p, const unmix_params u) {
    const int count = (int)(p.columns / dof_tile_columns), across = get_global_id(0), down = get_global_id(1);
    if (across >= count)
        return;
    if (u.gain) {
        bool near = false; // has a tile around it lost any light?
        for (int y = max(down - 1, 0); y <= min(down + 1, (int)(p.rows / dof_tile_rows) - 1); ++y)
            for (int x = max(across - 1, 0); x <= min(across + 1, count - 1); ++x)
                near |= tiles[y * count + x] != 0;
        if (!near)
            return;
    }
    bool any = false;
    const int top = down * dof_tile_rows;
    for (int first = across * dof_tile_columns; first < (across + 1) * dof_tile_columns; first += V) {
        const size_t at = in_planes(&p, 0, (uint)first, (uint)top);
        floatV above = beside(planes, &p, at - p.stride, top - 1, u.gain), same = beside(planes, &p, at, top, u.gain);
        for (int y = 0; y < dof_tile_rows; ++y) {
            const size_t begin = at + (size_t)y * p.stride;
            const floatV below = beside(planes, &p, begin + p.stride, top + y + 1, u.gain),
                         here = LOAD(float, planes + begin),
                         other = u.gain ? max(max(above, same), below) : min(min(above, same), below);
            const intV some = (here >= 0.0f) & (fabs(other - here) > p.per_octave * 0.0625f);
            if (any_of(some))
                any |= unmix(planes, color, state, &grid, &p, u.gain, first, top + y, some);
            above = same;
            same = below;
        }
    }
    if (!u.gain)
        tiles[down * count + across] = any;
}
