// Tiles of the depth of field: their size, and how a pixel takes part in a layer.
// Built for: CHANNELS = 3 4

#ifndef FATHOM_TILES_H
#define FATHOM_TILES_H

#include "vector.h"
#include "params.h"

#define TILE_COLUMNS 64
#define TILE_ROWS 8
#define TILE_WORDS 5 // of bits
#define MARGIN 16
#define NOWHERE -1e6f // the layer of what takes part in nothing
#define JUMP 2.0f     // layers: a surface's neighbours in depth are not behind it

#if !defined(CHANNELS) || CHANNELS < 3 || CHANNELS > 4
#error "CHANNELS is not defined: 3 or 4, of a pixel's colour"
#endif

// Of a pixel's first plane: column x of tile `across`, row y of all.
INLINE size_t in_planes(const blur_params* p, uint across, uint x, uint y) {
    return (size_t)y * p->stride + MARGIN + across * TILE_COLUMNS + x;
}

// What layer k finds in a row of tiles, `pad` columns around a tile: 2 pixels of its own, 1 only some that are not nearer,
// 0 none.
INLINE uint found_around(__global const uint* tiles, const blur_params* p, uint across, uint down, uint pad, uint k) {
    const uint aside = (pad + TILE_COLUMNS - 1) / TILE_COLUMNS, count = p->columns / TILE_COLUMNS;
    const uint first = across > aside ? across - aside : 0, last = min(across + aside, count - 1);
    const uint from = k > 0 ? k - 1 : 0; // pixels that lie between the layer before and this one
    uint some = 0;
    for (uint tile = first; tile <= last; ++tile) {
        __global const uint* words = tiles + TILE_WORDS * (down * count + tile);
        if (words[k / 32] >> k % 32 & 1u)
            return 2;
        for (uint word = from / 32; word < TILE_WORDS; ++word) {
            const uint bits = word == TILE_WORDS - 1 ? words[word] & 0x7fffffffu : words[word];
            some |= word == from / 32 ? bits >> from % 32 : bits;
        }
    }
    return some != 0;
}

// An entry of a list of tiles.
#define ENTRY_ACROSS(entry) ((entry)&0xffffu)
#define ENTRY_DOWN(entry) ((entry) >> 16 & 0x3fffu)
#define ENTRY_NEAR 0x40000000u    // some pixels lie before the focus
#define ENTRY_FOLLOWS 0x80000000u // the layer just before was here too

// Layers that the pixels lie in of rows [begin, end), so many columns aside of V of them.
typedef struct {
    float least, greatest;
} layer_range;

INLINE layer_range layers_within(__global const float* column, const blur_params* p, int begin, int end, int aside,
                                 uint surfaces) {
    floatV least = INFINITY, greatest = -INFINITY;
    for (int row = max(begin, 0); row < min(end, (int)p->rows); ++row) {
        for (uint surface = 0; surface < surfaces; ++surface) {
            __global const float* from = column + surface * (1 + CHANNELS) * p->plane + (size_t)row * p->stride;
            for (int x = -aside;; x = min(x + V, aside)) {
                const floatV s = LOAD(float, from + x);
                least = min(least, select((floatV)INFINITY, s, s >= 0.0f));
                greatest = max(greatest, s);
                if (x == aside)
                    break;
            }
        }
    }
    const float_lanes lows = least, highs = greatest;
    layer_range range = {INFINITY, -INFINITY};
    for (int i = 0; i < V; ++i) {
        range.least = min(range.least, ((const float*)&lows)[i]);
        range.greatest = max(range.greatest, ((const float*)&highs)[i]);
    }
    return range;
}

#endif
