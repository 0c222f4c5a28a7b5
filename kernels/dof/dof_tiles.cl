// Which layers a tile's pixels lie in, a bit each; under BEHIND also the layers of the surfaces behind them. The last
// bit says whether some colour lies beyond the knee, the two before it whether something before the focus ends in either half of
// its columns, of dof_hiding_columns each. Under
// HIDING only the pixels count that have a surface behind them, and tiles are narrower.
// Built for: BEHIND = 0 1; HIDING = 0 1

#include "dof/tiles.h"

#if !defined(BEHIND) || !defined(HIDING)
#error "BEHIND and HIDING are not defined: 1 where pixels have a second surface, and to count these only, 0 otherwise"
#endif

#if HIDING
#define COLUMNS dof_hiding_columns
#else
#define COLUMNS dof_tile_columns
#endif

#define STEP 0.5f // layers between neighbours, more than which no surface is taken to have

// Does something before the focus end between two pixels?
INLINE intV ends_between(floatV one, floatV other, float middle) {
    return (min(one, other) >= 0.0f) & (min(one, other) < middle) & (fabs(one - other) > STEP);
}

KERNEL void dof_tiles(__global const float* planes, __global uint* tiles, const blur_params p) {
    const uint across = p.columns / COLUMNS, tile = get_global_id(0), down = get_global_id(1);
    if (tile >= across)
        return;
    uintV found[dof_tile_words];
    for (int word = 0; word < dof_tile_words; ++word)
        found[word] = 0;
    intV bright = 0, jump[dof_tile_columns / dof_hiding_columns] = {0, 0};
    for (uint row = 0; row < dof_tile_rows; ++row) {
        for (uint column = 0; column < COLUMNS; column += V) {
            const size_t at = in_planes(&p, 0, tile * COLUMNS + column, down * dof_tile_rows + row);
            const floatV here = LOAD(float, planes + at), right = LOAD(float, planes + at + 1);
            const floatV below = LOAD(float, planes + at + (down * dof_tile_rows + row + 1 < p.rows ? p.stride : 0));
            const uint half_of = column / dof_hiding_columns;
            jump[half_of] |= ends_between(here, right, (float)p.middle) | ends_between(here, below, (float)p.middle);
#if BEHIND
            jump[half_of] |= LOAD(float, planes + (1 + CHANNELS) * p.plane + at) >= 0.0f;
#endif
            for (uint surface = 0; surface <= BEHIND; ++surface) {
                const floatV s = LOAD(float, planes + surface * (1 + CHANNELS) * p.plane + at);
#if HIDING
                const intV known = LOAD(float, planes + (1 + CHANNELS) * p.plane + at) >= 0.0f;
#else
                const intV known = s >= 0.0f;
#endif
                const intV low = convert_intV(max(s, 0.0f)),
                           high = low + select((intV)0, (intV)1, convert_floatV(low) < s);
                for (int word = 0; word < dof_tile_words; ++word) {
                    const uintV one =
                        select((uintV)0, (uintV)1 << as_uintV(low & 31), as_uintV(((low >> 5) == word) & known));
                    const uintV two =
                        select((uintV)0, (uintV)1 << as_uintV(high & 31), as_uintV(((high >> 5) == word) & known));
                    found[word] |= one | two;
                }
                for (uint k = 1; k <= CHANNELS; ++k)
                    bright |= fabs(LOAD(float, planes + (surface * (1 + CHANNELS) + k) * p.plane + at)) > p.knee;
            }
        }
    }
    found[dof_tile_words - 1] |= select((uintV)0, (uintV)TILE_BRIGHT, as_uintV(bright)) |
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
