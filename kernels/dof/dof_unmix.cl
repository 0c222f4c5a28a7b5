// Takes the light of a blurred foreground out of the pixels beyond its edge, where an antialiased picture has mixed it in: see
// mixed.h. Under u.gain, which is launched next, it joins the foreground's own pixel beside it, with which it is spread. Beside a
// sharp foreground it stays where it is, on top of the blur of what lies behind.

#include "dof/mixed.h"

// Are there neighbours beside whose circles this one's may lie beyond an edge, or before it under `gain`?
INLINE intV may_be_edge(__global const float* planes, const blur_params* p, size_t at, uint row, uint gain) {
    const floatV here = LOAD(float, planes + at);
    floatV other = here;
    for (int dy = row > 0 ? -1 : 0; dy <= (row + 1 < p->rows ? 1 : 0); ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            const floatV one = LOAD(float, planes + (size_t)((long)at + dy * (long)p->stride + dx));
            other = gain ? max(other, one) : select(other, min(other, one), one >= 0.0f);
        }
    }
    return (here >= 0.0f) & (fabs(other - here) > p->per_octave * 0.0625f);
}

// Has light been taken from a pixel?
INLINE bool has_lost(__global const float* planes, __global const ELEMENT_TYPE* color, const grid_params* grid,
                     const blur_params* p, int column, int row, float* lost) {
    color_at(color, grid, p, column, row, lost);
    bool any_lost = false;
    for (uint k = 0; k < CHANNELS; ++k) {
        lost[k] -= planes[(k + 1) * p->plane + in_planes(p, 0, (uint)column, (uint)row)];
        any_lost |= lost[k] != 0.0f;
    }
    return any_lost;
}

KERNEL void dof_unmix(__global float* planes, __global const ELEMENT_TYPE* color, __global float* state,
                      const grid_params grid, const blur_params p, const unmix_params u) {
    const uint first = get_global_id(0) * V, row = get_global_id(1);
    if (first >= p.columns)
        return;
    const size_t begin = in_planes(&p, 0, first, row);
    const intV some = may_be_edge(planes, &p, begin, row, u.gain);
    if (!any_of(some))
        return;
    const uint_lanes lanes = as_uintV(some);
    for (int i = 0; i < V; ++i) {
        if (!((const uint*)&lanes)[i])
            continue;
        const int column = (int)first + i;
        const edge_at e = edge_around(planes, &p, column, (int)row);
        across_edge way;
        float light[CHANNELS];
        if (u.gain) {
            const light_parts parts = parts_of_light(&e);
            if (!(parts.moves > 0.0f))
                continue;
            for (int n = 0; n < 9; ++n) {
                const int x = column + n % 3 - 1, y = (int)row + n / 3 - 1;
                if (!(e.excess[n] > e.excess[HERE]) || !has_lost(planes, color, &grid, &p, x, y, light))
                    continue;
                const edge_at beyond = edge_around(planes, &p, x, y);
                if (beyond.side > 0 && find_across(&beyond, &way) && x + way.to_x == column && y + way.to_y == (int)row)
                    for (uint k = 0; k < CHANNELS; ++k)
                        planes[(k + 1) * p.plane + begin + i] += parts.moves / (parts.moves + parts.stays) * light[k];
            }
            continue;
        }
        if (e.side <= 0 || !find_across(&e, &way) ||
            !light_of_nearer(planes, color, &grid, &p, column, (int)row, &e, &way, light))
            continue;
        const edge_at nearer = edge_around(planes, &p, column + way.to_x, (int)row + way.to_y);
        const light_parts parts = parts_of_light(&nearer);
        const bool laid = row >= p.state_row && row - p.state_row < p.state_plane / p.stride;
        for (uint k = 0; k < CHANNELS; ++k) {
            planes[(k + 1) * p.plane + begin + i] -= (parts.moves + parts.stays) * light[k];
            if (laid)
                state[(k + 1) * p.state_plane + in_state(&p, begin + i)] = parts.stays * light[k];
        }
    }
}
