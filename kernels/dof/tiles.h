// Tiles of the depth of field: their size, and how a pixel takes part in a layer.
// Built for: CHANNELS = 3 4

#ifndef FATHOM_TILES_H
#define FATHOM_TILES_H

#include "vector.h"
#include "params.h"

#define NOWHERE -1e6f // the layer of a pixel that takes part in no layer
#define JUMP 2.0f     // layers: a surface's neighbours in depth are not behind it
#define APART 2.0f    // pixels that a slope's circles do not differ by from one pixel to the next
#define SLOPE 4.0f    // layers more, over which what a slope hides of its own pixels comes into view

// A guess is told from a second surface that is known by half a step of layers.
#define GUESSED 0x1p-10f
#define IS_GUESS(second) (2.0f * ((second) * 512.0f - floor((second) * 512.0f)))

// How far a surface is one that something is guessed behind: not if it is in focus, nor if its circle is very large.
#define HIDES(first, p) hides_within(fabs((first) - (float)(p)->middle), p)
#define hides_within(away, p) min(max(min(away - 1.0f, 1.0f - (away - (p)->guessed) * (1.0f / (p)->per_octave)), 0.0f), 1.0f)

// Differences of running sums hold the rounding of both. Where they know less of an aperture than so many pixels, a layer is seen
// that much less, since their rounding is divided by it; and what little they have below 0 of a colour is none.
#define RUNNING_LEAST 0.25f
#define RUNNING_ROUNDING 0x1p-12f

INLINE floatV of_running(floatV color) {
    return select(color, (floatV)0.0f, (color < 0.0f) & (color > -RUNNING_ROUNDING));
}

// Bits of a tile's last word that are no layer: some colour lies beyond the knee; some pixel's area is not a pixel's; some
// neighbours of one another do not lie on one surface, the nearer of them before the focus.
#define TILE_BRIGHT 0x80000000u
#define TILE_AREA 0x10000000u
#define TILE_JUMP 0x20000000u // in the first half of its columns; the next bit is the second half's

#if !defined(CHANNELS) || CHANNELS < 3 || CHANNELS > 4
#error "CHANNELS is not defined: 3 or 4, of a pixel's colour"
#endif

// The element of the first plane that holds column x of tile `across` and row y of the image.
INLINE size_t in_planes(const blur_params* p, uint across, uint x, uint y) {
    return (size_t)y * p->stride + dof_margin + across * dof_tile_columns + x;
}

// The element of the state's first plane that belongs to an element of the planes' first one.
INLINE size_t in_state(const blur_params* p, size_t at) {
    return at - (size_t)p->state_row * p->stride;
}

// The signed circle of a layer, or between two, pixels; 0 in focus.
INLINE float circle_of(float layer, const blur_params* p) {
    const float away = fabs(layer - (float)p->middle) / p->per_octave, octave = floor(away);
    const float power = as_float(((int)octave + 127) << 23); // ldexp() is slow
    const float size = away > 0.0f ? power * (1.0f + (away - octave)) : 0.0f;
    return layer < (float)p->middle ? -size : size;
}

// Circles less a pixel, with their sign: 0 for what is in focus. They grow with the layer.
INLINE float4 excess_of_4(float4 layer, const blur_params* p) {
    const float4 away = fabs(layer - (float)p->middle) * (1.0f / p->per_octave), octave = floor(away);
    const float4 power = as_float4((convert_int4(octave) + 127) << 23);
    const float4 size = power * (1.0f + p->offset) * (1.0f + (away - octave)) - (p->offset + 1.0f);
    return select(size, -size, layer < (float)p->middle);
}

INLINE float excess_of(float layer, const blur_params* p) {
    return excess_of_4((float4)(layer), p).x;
}

// A row of a block.
typedef float8 __attribute__((aligned(4))) float8_anywhere;

INLINE bool any_of_8(int8 condition) {
    const int4 four = condition.lo | condition.hi;
    return (four.x | four.y | four.z | four.w) != 0;
}

INLINE float8 excess_of_8(float8 layers, const blur_params* p) {
    return (float8)(excess_of_4(layers.lo, p), excess_of_4(layers.hi, p));
}

INLINE float rising(float x, float from, float to) {
    return min(max((x - from) / (to - from), 0.0f), 1.0f);
}

// What layer k finds in a row of tiles, `pad` columns around a tile. 2: pixels of its own; 1: only pixels that are not
// nearer; 0: none.
INLINE uint found_around(__global const uint* tiles, const blur_params* p, uint across, uint down, uint pad, uint k) {
    const uint aside = (pad + dof_tile_columns - 1) / dof_tile_columns, count = p->columns / dof_tile_columns;
    const uint first = across > aside ? across - aside : 0, last = min(across + aside, count - 1);
    const uint from = k > 0 ? k - 1 : 0; // pixels that lie between the layer before and this one
    uint some = 0;
    for (uint tile = first; tile <= last; ++tile) {
        __global const uint* words = tiles + dof_tile_words * (down * count + tile);
        if (words[k / 32] >> k % 32 & 1u)
            return 2;
        for (uint word = from / 32; word < dof_tile_words; ++word) {
            const uint no_layer = word == dof_tile_words - 1 ? TILE_BRIGHT | TILE_AREA | TILE_JUMP | TILE_JUMP << 1 : 0u;
            const uint bits = words[word] & ~no_layer;
            some |= word == from / 32 ? bits >> from % 32 : bits;
        }
    }
    return some != 0;
}

// An entry of a list of tiles.
#define ENTRY_ACROSS(entry) ((entry)&ENTRY_COLUMN_MASK)
#define ENTRY_DOWN(entry) ((entry) >> ENTRY_ROW_SHIFT & ENTRY_ROW_MASK)
#define ENTRY_FOREGROUND (1u << ENTRY_FOREGROUND_BIT)
#define ENTRY_FOLLOWS (1u << ENTRY_FOLLOWS_BIT)

// The range of layers that the pixels of rows [begin, end) lie in, up to `aside` columns beside V pixels.
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
    return (layer_range){least_of(least), -least_of(-greatest)};
}

#endif
