// One slice of circle of confusion, over and through those before it.
//   alpha = sum of the aperture over the slice's own pixels / sum over these and all behind it, both with its own circle
//   colour += T alpha (mean of the slice's own), T <- T (1 - alpha)
// What lies before the slice hides part of its aperture; what it hides is unknown, so the share is that of what is known.
// Front to back this makes a surface that runs through many slices whole again: with T the share that lies behind, the
// product telescopes. An alpha of the own sum alone, as painters have it, counts complementary coverage twice.
// What a blurred foreground hides of something sharper is nowhere in the image. There the colour behind is the mean of what
// lies behind within the foreground's own circle (FILL), used by dof.cl for what is left of T.
// Nothing is summed where T is 0, nor rows of tiles without what lies in the slice or behind it, and no colours where nothing
// lies in the slice: all of that would add zeros, so the bits are the same.

#include "tiles.h"

#if !defined(DIRECT) || !defined(FILL) || !defined(BRIGHT)
#error "DIRECT, FILL and BRIGHT are not defined: 1 to read pixels instead of strips, to sum what lies behind, and where\
 strips hold what lies beyond the knee, 0 otherwise"
#endif
#ifndef BEHIND
#error "BEHIND is not defined: 1 where pixels have a second surface, 0 otherwise"
#endif
#define PLANES (2 + CHANNELS + FILL * (2 + CHANNELS) + BRIGHT * CHANNELS)

// Rows of pixels at once, which read nearly the same strips.
#define ROWS 2

#if DIRECT
INLINE void add_span(__global const float* from, const span_params* span, const blur_params* p, float slice, floatV* sum) {
    const floatV weight = span->weight;
#if FILL
    const float alike = 2.0f * ((float)p->middle - slice); // slices on, circles are as large again
#endif
    for (int column = span->low; column < span->high; ++column) {
        const floatV off = LOAD(float, from + column) - slice;
        const floatV own = weight * max(1.0f - fabs(off), 0.0f);
#if BEHIND
        __global const float* second = from + (1 + CHANNELS) * p->plane + column;
        const floatV off_second = LOAD(float, second) - slice, farther = max(off, off_second);
        const floatV own_second = weight * max(1.0f - fabs(off_second), 0.0f);
        sum[0] += own_second;
        for (int k = 0; k < CHANNELS; ++k)
            sum[2 + k] = fma(own_second, LOAD(float, second + (k + 1) * p->plane), sum[2 + k]);
#else
        const floatV farther = off;
#endif
        sum[0] += own;
        sum[1] = fma(weight, min(max(farther + 2.0f, 0.0f), 1.0f), sum[1]);
#if FILL
        const floatV sharper = weight * min(max(min(off - 1.0f, alike - off), 0.0f), 1.0f);
        sum[2 + CHANNELS] += sharper;
        sum[3 + 2 * CHANNELS] += weight * min(max(off - alike + 1.0f, 0.0f), 1.0f);
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

// The same of a row without any of the slice's own.
INLINE void add_behind(__global const float* from, const span_params* span, uint plane, floatV* sum) {
    __global const float* here = from + plane;
    sum[1] = fma((floatV)span->weight, LOAD(float, here + span->high) - LOAD(float, here + span->low), sum[1]);
}
#endif

// Lays the slice's share of a row of pixels over what was seen before it.
// `wide`: 1 where the slice's circle is larger than that of a foreground in the pixel itself, and no plate says what that hides.
INLINE void composite(__global float* here, uint plane, bool follows, const floatV* sum, const floatV* wide) {
    __global float* before = here + (2 * CHANNELS + 2) * plane;
    __global float* left_to_wide = before + plane;
    const floatV through = LOAD(float, here);
    const floatV through_far = follows ? LOAD(float, before) : through;
    *(__global float_lanes*)before = through;
    const intV some = (sum[0] > 0.0f) & (through > 0.0f);
    if (!any_of(some))
        return;
    floatV seen = select((floatV)0.0f, min(through, through_far * (sum[0] / sum[1])), some);
    if (wide) {
        const floatV left = LOAD(float, left_to_wide);
        seen = fma(*wide, min(seen, max(left, 0.0f)) - seen, seen);
        *(__global float_lanes*)left_to_wide = fma(-*wide, seen, left);
    }
    const floatV share = select((floatV)0.0f, seen / sum[0], some);
    *(__global float_lanes*)here = through - seen;
    for (int k = 0; k < CHANNELS; ++k) {
        __global float* to = here + (k + 1) * plane;
#if BRIGHT
        const floatV colour = sum[2 + k] + sum[PLANES - CHANNELS + k];
#else
        const floatV colour = sum[2 + k];
#endif
        *(__global float_lanes*)to = fma(share, colour, LOAD(float, to));
    }
#if FILL
    // The mean of what each slice of the foreground leaves.
    const floatV left = LOAD(float, left_to_wide), wider = through_far * (sum[3 + 2 * CHANNELS] / sum[1]);
    const floatV part = seen / (1.0f - (through - seen));
    const intV first = through == 1.0f;
    *(__global float_lanes*)left_to_wide = select(left, select(fma(wider - left, part, left), wider, first), some);
    __global float* hidden = here + (CHANNELS + 1) * plane;
    *(__global float_lanes*)hidden = fma(share, sum[2 + CHANNELS], LOAD(float, hidden));
    for (int k = 0; k < CHANNELS; ++k) {
        __global float* to = hidden + (k + 1) * plane;
        *(__global float_lanes*)to = fma(share, sum[3 + CHANNELS + k], LOAD(float, to));
    }
#endif
}

__kernel void dof_gather(__global const float* planes, __global const uint* tiles, __global const float* source,
                         __global const uint* list,
                         __global const uint* starts, __global const float* spans, __global float* state,
                         const blur_params p, const slice_params s) {
    // Neighbours share a group, and what they read its memory.
    const uint item = get_global_id(0), x = item % (TILE_COLUMNS / V) * V;
    const uint index = item / (TILE_COLUMNS / V) / (TILE_ROWS / ROWS);
    if (index >= s.tiles)
        return;
    const uint entry = list[s.list + index], across = entry & 0xffffu, down = entry >> 16 & 0x3fffu;
    const int y = (int)(down * TILE_ROWS + item / (TILE_COLUMNS / V) % (TILE_ROWS / ROWS) * ROWS);
    const int pitch = (int)s.pitch, rows = (int)p.rows / pitch, height = 2 * s.reach + 1;
    const size_t at = in_planes(&p, across, x, y);

    const int begin = max(y / pitch - s.reach, 0), end = min((y + ROWS - 1) / pitch + s.reach + 1, rows);
    const int per_tile = TILE_ROWS / pitch, last_tile = (end - 1) / per_tile;
    __global float* here = state + at;
    intV open = 0;
    for (int i = 0; i < ROWS; ++i)
        open |= LOAD(float, here + i * p.stride) > 0.0f;
    if (!any_of(open))
        return;
    uint most = 0;
    for (int tile = begin / per_tile; tile <= last_tile && most < 2; ++tile)
        most = max(most, found_around(tiles, &p, across, (uint)tile, s.pad, (uint)s.slice));
    if (most < 2) { // nothing to see here, but the next slice asks for T before this one
        __global float* before = here + (2 * CHANNELS + 2) * p.plane;
        for (int i = 0; i < ROWS; ++i)
            *(__global float_lanes*)(before + i * p.stride) = LOAD(float, here + i * p.stride);
        return;
    }

    floatV sum[ROWS][PLANES];
    for (int i = 0; i < ROWS; ++i)
        for (int k = 0; k < PLANES; ++k)
            sum[i][k] = 0.0f;
#if !DIRECT
    const int first = (int)(s.first * TILE_ROWS) / pitch;
    __global const float* block = source + (size_t)across * s.strip_column + s.pad + x;
#endif
    for (int tile = begin / per_tile; tile <= last_tile; ++tile) {
        const uint found = found_around(tiles, &p, across, (uint)tile, s.pad, (uint)s.slice);
        if (found == 0)
            continue;
        const int last_row = min((tile + 1) * per_tile, end);
        for (int row = max(tile * per_tile, begin); row < last_row; ++row) {
#if DIRECT
            __global const float* from = source + at + (long)(row - y) * (long)p.stride;
#else
            __global const float* from = block + (size_t)(row - first) * s.strip_row;
#endif
#pragma unroll
            for (int i = 0; i < ROWS; ++i) {
                const int which = row - (y + i) / pitch + s.reach;
                if (which < 0 || which >= height)
                    continue;
                const uint entry_of_row = s.starts + (uint)((y + i) % pitch * height + which);
                const uint last = starts[entry_of_row + 1];
                for (uint j = starts[entry_of_row]; j < last; ++j) {
                    const span_params span = ((__global const span_params*)spans)[j];
#if DIRECT
                    add_span(from, &span, &p, s.slice, sum[i]);
#else
                    if (FILL | (found == 2))
                        add_span(from, &span, s.strip_plane, sum[i]);
                    else
                        add_behind(from, &span, s.strip_plane, sum[i]);
#endif
                }
            }
        }
    }
    const bool has_near = entry >> 30 & 1u;
    for (int i = 0; i < ROWS; ++i) {
        const size_t row = at + (size_t)i * p.stride;
        const floatV own = LOAD(float, planes + row), alike = 2.0f * (float)p.middle - own;
        intV unknown = own < (float)p.middle; // what lies behind it
#if BEHIND
        unknown &= LOAD(float, planes + (1 + CHANNELS) * p.plane + row) < 0.0f;
#endif
        const floatV wide = select((floatV)0.0f, min(max(s.slice - alike + 1.0f, 0.0f), 1.0f), unknown);
        composite(state + row, p.plane, entry >> 31, sum[i], has_near && s.slice > (float)p.middle ? &wide : 0);
    }
}
