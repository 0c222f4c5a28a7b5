// Takes the light of a blurred foreground out of the pixels beyond its edge, where an antialiased picture has mixed it in: see
// mixed.h. It joins the foreground's own pixel beside it, with which it is spread. Beside a sharp foreground it stays where it
// is, on top of the blur of what lies behind.

#include "dof/mixed.h"

// Are the circles of a pixel and its neighbours apart far enough that an edge may lie between them?
INLINE intV may_be_edge(__global const float* planes, const blur_params* p, size_t at, uint row) {
    const intV known = LOAD(float, planes + at) >= 0.0f;
    floatV least = INFINITY, greatest = NOWHERE;
    for (int dy = row > 0 ? -1 : 0; dy <= (row + 1 < p->rows ? 1 : 0); ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            const floatV other = LOAD(float, planes + (size_t)((long)at + dy * (long)p->stride + dx));
            least = min(least, select((floatV)INFINITY, other, other >= 0.0f));
            greatest = max(greatest, other);
        }
    }
    return known & (greatest - least > p->per_octave * 0.125f);
}

KERNEL void dof_unmix(__global float* planes, __global const ELEMENT_TYPE* color, __global float* state,
                      const grid_params grid, const blur_params p) {
    const uint first = get_global_id(0) * V, row = get_global_id(1);
    if (first >= p.columns)
        return;
    const size_t begin = in_planes(&p, 0, first, row);
    const intV some = may_be_edge(planes, &p, begin, row);
    if (!any_of(some))
        return;
    const uint_lanes lanes = as_uintV(some);
    for (int i = 0; i < V; ++i) {
        if (!((const uint*)&lanes)[i])
            continue;
        const int column = (int)first + i;
        const edge_at e = edge_around(planes, &p, column, (int)row);
        mixed_light mixed;
        if (e.side > 0 && light_of_nearer(planes, color, &grid, &p, column, (int)row, &e, &mixed)) {
            const bool laid = row >= p.state_row && row - p.state_row < p.state_plane / p.stride;
            for (uint k = 0; k < CHANNELS; ++k) {
                planes[(k + 1) * p.plane + begin + i] -= (mixed.moves + mixed.stays) * mixed.light[k];
                if (laid)
                    state[(k + 1) * p.state_plane + in_state(&p, begin + i)] = mixed.stays * mixed.light[k];
            }
        } else if (e.side < 0) {
            for (int dy = -1; dy <= 1; ++dy) {
                for (int dx = -1; dx <= 1; ++dx) {
                    const float other = layer_at(planes, &p, column + dx, (int)row + dy);
                    if (!(other > e.layer))
                        continue;
                    const edge_at beyond = edge_around(planes, &p, column + dx, (int)row + dy);
                    if (beyond.side > 0 &&
                        light_of_nearer(planes, color, &grid, &p, column + dx, (int)row + dy, &beyond, &mixed) &&
                        mixed.column == column && mixed.row == (int)row)
                        for (uint k = 0; k < CHANNELS; ++k)
                            planes[(k + 1) * p.plane + begin + i] += mixed.moves * mixed.light[k];
                }
            }
        }
    }
}
