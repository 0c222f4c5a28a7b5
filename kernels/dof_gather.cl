// One slice of circle of confusion, over and through those before it.
//   alpha = sum of the aperture over the slice's own pixels / sum over these and all behind it, both with its own circle
//   colour += T alpha (mean of the slice's own), T <- T (1 - alpha)
// What lies before the slice hides part of its aperture; what it hides is unknown, so the share is that of what is known.
// Front to back this makes a surface that runs through many slices whole again: with T the share that lies behind, the
// product telescopes. An alpha of the own sum alone, as painters have it, counts complementary coverage twice.
// What a blurred foreground hides of something sharper is nowhere in the image. There the colour behind is the mean of what
// lies behind within the foreground's own circle (FILL), used by dof.cl for what is left of T.

#include "tiles.h"

#if !defined(DIRECT) || !defined(FILL) || !defined(BRIGHT)
#error "DIRECT, FILL and BRIGHT are not defined: 1 to read pixels instead of strips, to sum what lies behind, and where\
 strips hold what lies beyond the knee, 0 otherwise"
#endif
#define PLANES (2 + CHANNELS + FILL * (1 + CHANNELS) + BRIGHT * CHANNELS)

__kernel void dof_gather(__global const float* source, __global const uint* list, __global const uint* starts,
                         __global const float* spans, __global float* state, const blur_params p, const slice_params s) {
    const uint index = get_global_id(0) / (TILE_COLUMNS / V), x = get_global_id(0) % (TILE_COLUMNS / V) * V;
    if (index >= s.tiles)
        return;
    const uint entry = list[s.list + index], across = entry & 0xffffu, down = entry >> 16 & 0x7fffu;
    const int y = (int)(down * TILE_ROWS + get_global_id(1));
    const int pitch = (int)s.pitch, middle = y / pitch, phase = y % pitch, rows = (int)p.rows / pitch;
    const size_t at = in_planes(&p, across, x, y);

    floatV sum[PLANES];
    for (int k = 0; k < PLANES; ++k)
        sum[k] = 0.0f;
    const int begin = max(middle - s.reach, 0), end = min(middle + s.reach + 1, rows);
#if !DIRECT
    const int first = (int)(s.first * TILE_ROWS) / pitch;
    __global const float* block = source + (size_t)across * s.strip_column + s.pad + x;
#endif
    for (int row = begin; row < end; ++row) {
        const uint which = s.starts + (uint)(phase * (2 * s.reach + 1) + row - middle + s.reach);
#if DIRECT
        __global const float* from = source + at + (long)(row - y) * (long)p.stride;
#else
        __global const float* from = block + (size_t)(row - first) * s.strip_row;
#endif
        for (uint i = starts[which]; i < starts[which + 1]; ++i) {
            const span_params span = ((__global const span_params*)spans)[i];
            const floatV weight = span.weight;
#if DIRECT
            for (int column = span.low; column < span.high; ++column) {
                const floatV off = LOAD(float, from + column) - s.slice;
                const floatV own = weight * max(1.0f - fabs(off), 0.0f);
                sum[0] += own;
                sum[1] = fma(weight, min(max(off + 2.0f, 0.0f), 1.0f), sum[1]);
#if FILL
                const floatV beyond = weight * min(max(off - 1.0f, 0.0f), 1.0f);
                sum[2 + CHANNELS] += beyond;
#endif
                for (int k = 0; k < CHANNELS; ++k) {
                    const floatV value = LOAD(float, from + (k + 1) * p.plane + column);
                    sum[2 + k] = fma(own, value, sum[2 + k]);
#if FILL
                    sum[3 + CHANNELS + k] = fma(beyond, value, sum[3 + CHANNELS + k]);
#endif
                }
            }
#else
            __global const float* low = from + span.low;
            __global const float* high = from + span.high;
#pragma unroll
            for (int k = 0; k < PLANES; ++k)
                sum[k] = fma(weight, LOAD(float, high + k * s.strip_plane) - LOAD(float, low + k * s.strip_plane), sum[k]);
#endif
        }
    }

    __global float* here = state + at;
    __global float* before = here + (2 * CHANNELS + 2) * p.plane;
    const floatV through = LOAD(float, here), through_far = entry >> 31 ? LOAD(float, before) : through;
    const intV some = sum[0] > 0.0f;
    const floatV seen = select((floatV)0.0f, min(through, through_far * (sum[0] / sum[1])), some);
    const floatV share = select((floatV)0.0f, seen / sum[0], some);
    *(__global float_lanes*)before = through;
    *(__global float_lanes*)here = through - seen;
    for (int k = 0; k < CHANNELS; ++k) {
        __global float* to = here + (k + 1) * p.plane;
#if BRIGHT
        const floatV colour = sum[2 + k] + sum[PLANES - CHANNELS + k];
#else
        const floatV colour = sum[2 + k];
#endif
        *(__global float_lanes*)to = fma(share, colour, LOAD(float, to));
    }
#if FILL
    __global float* hidden = here + (CHANNELS + 1) * p.plane;
    *(__global float_lanes*)hidden = fma(share, sum[2 + CHANNELS], LOAD(float, hidden));
    for (int k = 0; k < CHANNELS; ++k) {
        __global float* to = hidden + (k + 1) * p.plane;
        *(__global float_lanes*)to = fma(share, sum[3 + CHANNELS + k], LOAD(float, to));
    }
#endif
}
