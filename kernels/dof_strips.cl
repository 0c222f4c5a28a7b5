// Running sums along the rows of one slice, restarted a little before every column of tiles: what the slice's own pixels
// cover, what they and those behind cover, and the colour of the slice's own; under FILL also what is certainly behind and
// its colour, under BRIGHT what of the slice's colour lies beyond the knee. A pixel counts for slice k by 1 - |s - k|, as
// behind it by s - k up to 1, and as certainly behind, which the other share of a surface between two slices is not, by
// s - k - 1 up to 1.
// Restarted, and with highlights summed apart, since what a running sum has met stays in its rounding.

#include "tiles.h"

#if !defined(FILL) || !defined(BRIGHT)
#error "FILL and BRIGHT are not defined: 1 to sum what lies behind, and what lies beyond the knee, 0 otherwise"
#endif
#define PLANES (2 + CHANNELS + FILL * (1 + CHANNELS) + BRIGHT * CHANNELS)

__kernel void dof_strips(__global const float* planes, __global const uint* list, __global float* strips,
                         const blur_params p, const slice_params s) {
    const uint index = get_global_id(0), row = get_global_id(1);
    if (index >= s.tiles)
        return;
    const uint across = list[s.list + index] & 0xffffu, down = list[s.list + index] >> 16;
    const int first = (int)(across * TILE_COLUMNS) - (int)s.pad;
    const int end = (int)(across * TILE_COLUMNS + TILE_COLUMNS + s.pad);
    const uint kept = (down - s.first) * (TILE_ROWS / s.pitch) + row;
    __global float* target = strips + (size_t)across * s.strip_column + (size_t)kept * s.strip_row;
    __global const float* source = planes + in_planes(&p, 0, 0, down * TILE_ROWS + row * s.pitch);

    float sum[PLANES];
    for (int k = 0; k < PLANES; ++k)
        sum[k] = 0.0f;
    for (int x = first; x < end; ++x, ++target) {
        for (int k = 0; k < PLANES; ++k)
            target[k * s.strip_plane] = sum[k];
        if (x < 0 || x >= (int)p.columns)
            continue;
        for (uint i = 0; i < s.pitch; ++i) {
            __global const float* here = source + (size_t)i * p.stride + x;
            const float off = here[0] - s.slice;
            const float own = max(1.0f - fabs(off), 0.0f);
            sum[0] += own;
            sum[1] += min(max(off + 2.0f, 0.0f), 1.0f);
#if FILL
            const float beyond = min(max(off - 1.0f, 0.0f), 1.0f);
            sum[2 + CHANNELS] += beyond;
#endif
            for (int k = 0; k < CHANNELS; ++k) {
                const float value = here[(k + 1) * p.plane];
#if BRIGHT
                const float base = min(max(value, -p.knee), p.knee);
                sum[PLANES - CHANNELS + k] += own * (value - base);
#else
                const float base = value;
#endif
                sum[2 + k] += own * base;
#if FILL
                sum[3 + CHANNELS + k] += beyond * value;
#endif
            }
        }
    }
    for (int k = 0; k < PLANES; ++k)
        target[k * s.strip_plane] = sum[k];
}
