// What a pixel has behind its surface, once two places are known: where something farther away is the nearest, and where it is the
// nearest that nothing lies before. The colour of a pixel beside something nearer may be mixed with that: it is if it lies
// between that and a pixel farther in. Then the nearest pixel farther in is taken, with a part of the border's colour: an
// eighth has the least error over the seven scenes of bench/views.hpp.

#ifndef FATHOM_BEHIND_H
#define FATHOM_BEHIND_H

#include "dof/tiles.h"

#define OF_BORDER 0.125f

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

// Stores the second surface of pixel `at`; none if `border` is `at` itself.
INLINE void put_behind(__global float* planes, const blur_params* p, size_t at, size_t border, size_t found, float mark) {
    __global float* second = planes + (1 + CHANNELS) * p->plane;
    const bool none = border == at;
    const float part = found == border ? 0.0f : mixed(planes, p, border, found);
    const float behind = fma(part, planes[found] - planes[border], planes[border]);
    second[at] = none ? NOWHERE : floor(fma(behind, 512.0f, 0.5f)) * 0x1p-9f + mark; // as dof_planes.cl has layers
    for (uint k = 1; k <= CHANNELS; ++k) {
        const float own = planes[k * p->plane + border];
        const float color = fma((1.0f - OF_BORDER) * part, planes[k * p->plane + found] - own, own);
        second[k * p->plane + at] = none ? 0.0f : color;
    }
}

#endif
