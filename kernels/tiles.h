// Tiles of the depth of field: their size, and how a pixel takes part in a slice.

#ifndef FATHOM_TILES_H
#define FATHOM_TILES_H

#include "lanes.h"
#include "params.h"

#define TILE_COLUMNS 64
#define TILE_ROWS 16
#define TILE_WORDS 5 // of bits
#define MARGIN 16
#define NOWHERE -1e6f // the slice of what takes part in nothing
#define JUMP 2.0f     // slices: a surface's neighbours in depth are not behind it

#if !defined(CHANNELS) || CHANNELS < 3 || CHANNELS > 4
#error "CHANNELS is not defined: 3 or 4, of a pixel's colour"
#endif

// Of a pixel's first plane: column x of tile `across`, row y of all.
INLINE size_t in_planes(const blur_params* p, uint across, uint x, uint y) {
    return (size_t)y * p->stride + MARGIN + across * TILE_COLUMNS + x;
}

#endif
