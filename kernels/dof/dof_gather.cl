// One layer of circle of confusion, over and through those before it.
//   alpha = sum of the aperture over the layer's own pixels / sum over these and all behind it, both with its own circle
//   colour += T alpha (mean of the layer's own), T <- T (1 - alpha)
// What lies before the layer hides part of its aperture; what it hides is unknown, so the fraction is that of what is
// known.
// Front to back this makes a surface that runs through many layers whole again: with T the fraction that lies behind, the
// product telescopes. An alpha of the own sum alone, as painters have it, counts complementary coverage twice.
// What a blurred foreground hides of something sharper is nowhere in the image. There the colour behind is the mean of what
// lies behind within the foreground's own circle (FILL), used by dof.cl for what is left of T.
// Sums that would only add zeros are left out, so the bits are the same: where T is 0, where no aperture around holds a
// pixel of the layer, rows of tiles without a pixel in the layer or behind it, and colours of rows without a pixel in
// the layer. Where pixels are read directly, an item goes through several layers, so that their results stay in the
// cache.
// Built for: FILL = 0 1; BRIGHT = 0 1; DIRECT = 0 1; BEHIND = 0 1 2

#ifndef DIRECT
#error "DIRECT is not defined: 1 to read pixels instead of strips, 0 otherwise"
#endif
#define RUNNING !DIRECT
#define MOMENT 0
#include "dof/layer.h"

#define ROWS dof_rows_at_once
#if DIRECT
#define WORDS 3 // of an entry of the list: LayerPass of dof_layers.hpp
#else
#define WORDS 1
#endif

#if DIRECT
// behind_layer of layer.h
INLINE floatV behind_of(floatV off) {
    return min(max(off + 2.0f, 0.0f), 1.0f);
}

INLINE void add_span(__global const float* from, const span_params* span, const blur_params* p, float layer, floatV* sum) {
#if FILL
    const float alike = 2.0f * ((float)p->middle - layer); // layers on, circles are as large again
#endif
    for (int column = span->low; column < span->high; ++column) {
        const floatV off = LOAD(float, from + column) - layer;
        const floatV area = p->areas ? span->weight * LOAD(float, from + p->areas + column) : (floatV)span->weight;
        const floatV own = area * max(1.0f - fabs(off), 0.0f);
        floatV behind = behind_of(off);
#if BEHIND
        __global const float* second = from + (1 + CHANNELS) * p->plane + column;
        const floatV off_second = LOAD(float, second) - layer;
        if (BEHIND == 1 || any_of(off_second > -2.0f)) {
#if BEHIND == 2
            const floatV open = OPEN_BEHIND(off + layer, off_second + layer, p);
            const floatV counted = area * COUNTED_BEHIND(open, off_second + layer, layer, p);
            behind = max(behind, open * behind_of(off_second));
#else
            const floatV counted = area;
            behind = behind_of(max(off, off_second));
#endif
            const floatV own_second = counted * max(1.0f - fabs(off_second), 0.0f);
            sum[0] += own_second;
            for (int k = 0; k < CHANNELS; ++k)
                sum[2 + k] = fma(own_second, LOAD(float, second + (k + 1) * p->plane), sum[2 + k]);
        }
#endif
        sum[0] += own;
        sum[1] = fma(area, behind, sum[1]);
#if FILL
        const floatV sharper = area * min(max(min(off - sharper_from(layer, p), alike - off), 0.0f), 1.0f);
        sum[2 + CHANNELS] += sharper;
        sum[3 + 2 * CHANNELS] += area * min(max(off - alike + 1.0f, 0.0f), 1.0f);
#endif
        for (int k = 0; k < CHANNELS; ++k) {
            const floatV value = LOAD(float, from + (k + 1) * p->plane + column);
            sum[2 + k] = fma(own, value, sum[2 + k]);
#if FILL
            sum[3 + CHANNELS + k] = fma(sharper, value, sum[3 + CHANNELS + k]);
#endif
        }
    }
}
#else
INLINE void add_span(__global const float* from, const span_params* span, uint plane, floatV* sum) {
    __global const float* low = from + span->low;
    __global const float* high = from + span->high;
    const floatV weight = span->weight;
#pragma unroll
    for (int k = 0; k < PLANES; ++k)
        sum[k] = fma(weight, LOAD(float, high + k * plane) - LOAD(float, low + k * plane), sum[k]);
}

// The same for a row that has no pixel of the layer: only what lies behind is summed.
INLINE void add_behind(__global const float* from, const span_params* span, uint plane, floatV* sum) {
    __global const float* here = from + plane;
    sum[1] = fma((floatV)span->weight, LOAD(float, here + span->high) - LOAD(float, here + span->low), sum[1]);
}
#endif

// What all sums of an item need.
typedef struct {
    __global const float* source; // of the item's first column: pixels in row 0, or strips
    __global const uint* tiles;
    __global const uint* starts;
    __global const span_params* spans;
    uint across; // the column of tiles
} gather_from;

// Sums over the aperture around each row.
INLINE void sum_rows(const gather_from* from, const blur_params* p, const layer_params* s, int y,
                     floatV sum[ROWS][PLANES]) {
    for (int i = 0; i < ROWS; ++i)
        for (int k = 0; k < PLANES; ++k)
            sum[i][k] = 0.0f;
    const int pitch = (int)s->pitch, rows = (int)p->rows / pitch, height = 2 * s->reach + 1;
    const int begin = max(y / pitch - s->reach, 0), end = min((y + ROWS - 1) / pitch + s->reach + 1, rows);
    const int per_tile = dof_tile_rows / pitch, last_tile = (end - 1) / per_tile;
    for (int tile = begin / per_tile; tile <= last_tile; ++tile) {
        const uint found = found_around(from->tiles, p, from->across, (uint)tile, s->pad, (uint)s->layer);
        if (found == 0)
            continue;
        const int last_row = min((tile + 1) * per_tile, end);
        for (int row = max(tile * per_tile, begin); row < last_row; ++row) {
#if DIRECT
            __global const float* here = from->source + (size_t)row * p->stride;
#else
            const int kept = row - (int)(s->first * dof_tile_rows) / pitch;
            __global const float* here = from->source + (size_t)kept * s->strip_row;
#endif
#pragma unroll
            for (int i = 0; i < ROWS; ++i) {
                const int which = row - (y + i) / pitch + s->reach;
                if (which < 0 || which >= height)
                    continue;
                const uint entry = s->starts + (uint)((y + i) % pitch * height + which), last = from->starts[entry + 1];
                for (uint j = from->starts[entry]; j < last; ++j) {
                    const span_params span = from->spans[j];
#if DIRECT
                    add_span(here, &span, p, s->layer, sum[i]);
#else
                    if (FILL | (found == 2))
                        add_span(here, &span, s->strip_plane, sum[i]);
                    else
                        add_behind(here, &span, s->strip_plane, sum[i]);
#endif
                }
            }
        }
    }
}

#if !DIRECT
// Does the layer have pixels of its own within reach of an item's?
INLINE bool any_around(const gather_from* from, const blur_params* p, const layer_params* s, int y) {
    const int pitch = (int)s->pitch, rows = (int)p->rows / pitch, per_tile = dof_tile_rows / pitch;
    const int begin = max(y / pitch - s->reach, 0), end = min((y + ROWS - 1) / pitch + s->reach + 1, rows);
    for (int tile = begin / per_tile; tile <= (end - 1) / per_tile; ++tile) {
        if (found_around(from->tiles, p, from->across, (uint)tile, s->pad, (uint)s->layer) < 2)
            continue;
        const int last_row = min((tile + 1) * per_tile, end);
        for (int row = max(tile * per_tile, begin); row < last_row; ++row) {
            const int kept = row - (int)(s->first * dof_tile_rows) / pitch;
            __global const float* own = from->source + (size_t)kept * s->strip_row;
            if (own[V + s->columns] > own[-s->columns])
                return true;
        }
    }
    return false;
}
#endif

// Lays a layer over the rows from y on; false where nothing is left to see.
INLINE bool lay_rows(const gather_from* from, __global const float* planes, __global float* state, const blur_params* p,
                     const layer_params* s, size_t at, int y, bool follows, bool has_foreground) {
    __global float* here = state + in_state(p, at);
    intV open = 0;
    for (int i = 0; i < ROWS; ++i)
        open |= LOAD(float, here + i * p->stride) > 0.0f;
    if (!any_of(open))
        return false;
#if !DIRECT
    if (!any_around(from, p, s, y)) {
        keep_open(here, p, ROWS);
        return true;
    }
#endif
    const layer_at layer = {planes, p, s->layer, follows, has_foreground};
    floatV sum[ROWS][PLANES];
    sum_rows(from, p, s, y, sum);
    for (int i = 0; i < ROWS; ++i)
        lay(&layer, state, at + (size_t)i * p->stride, sum[i]);
    return true;
}

KERNEL void dof_gather(__global const float* planes, __global const uint* tiles, __global const float* source,
                         __global const uint* list, __global const uint* starts, __global const float* spans,
                         __global float* state, const blur_params p, const layer_params s) {
    // Neighbouring items lie in one group, so that they read the same memory.
    const uint item = get_global_id(0), x = item % (dof_tile_columns / V) * V;
    const uint index = item / (dof_tile_columns / V) / (dof_tile_rows / ROWS);
    if (index >= s.tiles)
        return;
    const uint entry = list[s.list + index * WORDS], across = ENTRY_ACROSS(entry), down = ENTRY_DOWN(entry);
    const int y = (int)(down * dof_tile_rows + item / (dof_tile_columns / V) % (dof_tile_rows / ROWS) * ROWS);
    const size_t at = in_planes(&p, across, x, y);
    const bool has_foreground = entry & ENTRY_FOREGROUND;
#if DIRECT
    const size_t column = in_planes(&p, across, x, 0);
    const gather_from from = {source + column, tiles, starts, (__global const span_params*)spans, across};
    const uint reach = list[s.list + index * WORDS + 1], follow = list[s.list + index * WORDS + 2];
    const layer_range around =
        layers_within(planes + column, &p, y - dof_direct_reach, y + ROWS + dof_direct_reach, dof_direct_reach, 1 + (BEHIND > 0));
    bool skipped = false; // the layer before had nothing here: it left T as it was
    for (uint i = 0; i < 32 && reach >> i; ++i) {
        layer_params one = s;
        one.layer += (float)i;
        if (!(follow >> i & 1u))
            skipped = true;
        else if (i > 0 && !(reach >> (i - 1) & 1u)) // another launch laid the layer before
            skipped = false;
        if (!(reach >> i & 1u))
            continue;
        if (one.layer <= around.least - 1.0f || one.layer >= around.greatest + 1.0f) {
            skipped = true;
            continue;
        }
        one.starts = starts[s.starts + 2 * i];
        one.reach = (int)starts[s.starts + 2 * i + 1];
        if (!lay_rows(&from, planes, state, &p, &one, at, y, !skipped, has_foreground))
            return;
        skipped = false;
    }
    if (skipped)
        keep_open(state + in_state(&p, at), &p, ROWS);
#else
    const size_t first = (size_t)(across - s.first_column) * s.strip_column + s.pad + x;
    const gather_from from = {source + first, tiles, starts, (__global const span_params*)spans, across};
    lay_rows(&from, planes, state, &p, &s, at, y, entry & ENTRY_FOLLOWS, has_foreground);
#endif
}
