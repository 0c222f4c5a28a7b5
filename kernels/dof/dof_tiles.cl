// Which layers a tile's pixels lie in, a bit each. The last bit says whether some colour lies beyond the knee, the two before it
// whether something before the focus ends in either half of its columns, of dof_hiding_columns each, and the one before these
// whether some pixel's area is not a pixel's.
// Under HIDING tiles are narrower, and only the pixels count that have a surface behind them, with this one.
// Built for: HIDING = 0 1

#include "dof/tiles.h"

#ifndef HIDING
#error "HIDING is not defined: 1 for what hides something and what it hides, 0 for what is seen"
#endif

#if HIDING
#define COLUMNS dof_hiding_columns
#else
#define COLUMNS dof_tile_columns

#define STEP 0.5f // layers between neighbours, more than which no surface is taken to have

// Does something before the focus end between two pixels?
INLINE intV ends_between(floatV one, floatV other, float middle) {
    return (min(one, other) >= 0.0f) & (min(one, other) < middle) & (fabs(one - other) > STEP);
}
#endif

// Adds the bits of the layers around those of the known pixels.
INLINE void add_layers(uintV* found, floatV layer, intV known) {
    const intV low = convert_intV(max(layer, 0.0f)), high = low + select((intV)0, (intV)1, convert_floatV(low) < layer);
    for (int word = 0; word < dof_tile_words; ++word) {
        const uintV one = select((uintV)0, (uintV)1 << as_uintV(low & 31), as_uintV(((low >> 5) == word) & known));
        const uintV two = select((uintV)0, (uintV)1 << as_uintV(high & 31), as_uintV(((high >> 5) == word) & known));
        found[word] |= one | two;
    }
}

// Does a colour lie beyond the knee?
INLINE intV is_bright(__global const float* surface, const blur_params* p) {
    intV bright = 0;
    for (uint k = 1; k <= CHANNELS; ++k)
        bright |= fabs(LOAD(float, surface + k * p->plane)) > p->knee;
    return bright;
}

KERNEL void dof_tiles(__global const float* planes, __global uint* tiles, const blur_params p) {
    const uint across = p.columns / COLUMNS, tile = get_global_id(0), down = get_global_id(1);
    if (tile >= across)
        return;
    uintV found[dof_tile_words];
    for (int word = 0; word < dof_tile_words; ++word)
        found[word] = 0;
    intV bright = 0, area = 0, jump[dof_tile_columns / dof_hiding_columns] = {0, 0};
    for (uint row = 0; row < dof_tile_rows; ++row) {
        for (uint column = 0; column < COLUMNS; column += V) {
            __global const float* first =
                planes + in_planes(&p, 0, tile * COLUMNS + column, down * dof_tile_rows + row);
            const floatV here = LOAD(float, first);
#if HIDING
            __global const float* second = first + (1 + CHANNELS) * p.plane;
            const floatV behind = LOAD(float, second);
            const intV known = behind >= 0.0f;
            if (!any_of(known))
                continue;
            add_layers(found, here, known);
            add_layers(found, behind, known);
            bright |= is_bright(second, &p);
#else
            const floatV right = LOAD(float, first + 1);
            const floatV below = LOAD(float, first + (down * dof_tile_rows + row + 1 < p.rows ? p.stride : 0));
            jump[column / dof_hiding_columns] |=
                ends_between(here, right, (float)p.middle) | ends_between(here, below, (float)p.middle);
            add_layers(found, here, here >= 0.0f);
            bright |= is_bright(first, &p);
            area |= LOAD(float, first + p.areas) != 1.0f;
#endif
        }
    }
    found[dof_tile_words - 1] |= select((uintV)0, (uintV)TILE_BRIGHT, as_uintV(bright)) |
                                 select((uintV)0, (uintV)TILE_AREA, as_uintV(area)) |
                                 select((uintV)0, (uintV)TILE_JUMP, as_uintV(jump[0])) |
                                 select((uintV)0, (uintV)(TILE_JUMP << 1), as_uintV(jump[1]));
    for (int word = 0; word < dof_tile_words; ++word) {
        const uint_lanes lanes = found[word];
        uint all = 0;
        for (int i = 0; i < V; ++i)
            all |= ((const uint*)&lanes)[i];
        tiles[dof_tile_words * (down * across + tile) + word] = all;
    }
}
