// Running sums along the rows of one layer, restarted a little before every column of tiles: what the layer's own pixels
// cover, what they and all pixels behind them cover, and the colour of its own pixels. Under FILL, which is for layers before the
// focus, three more: what those pixels cover that are certainly behind the layer and sharper, their colour, and what those
// cover that lie behind the focus and are no sharper. Under BRIGHT the parts of all these colours that lie beyond the knee
// have sums of their own. A pixel counts for layer k by 1 - |s - k|, as behind it by s - k up to 1, and as certainly
// behind, which the other fraction of a surface between two layers is not, by s - k - 1 up to 1.
// Under BEHIND a pixel has a second surface, which counts like the first.
// The sums are restarted, and highlights are summed apart, because large values leave their rounding in a running sum.
// Built for: FILL = 0 1; BRIGHT = 0 1; BEHIND = 0 1 2

#define MOMENT 0
#include "dof/layer.h"
#include "dof/running.h"

KERNEL void dof_strips(__global const float* planes, __global const uint* tiles, __global const uint* list,
                         __global float* strips, const blur_params p, const layer_params s) {
    const uint index = get_global_id(0), row = get_global_id(1);
    if (index >= s.tiles)
        return;
    const strip_row strip = strip_row_of(planes, list, strips, &p, &s, index, row);
    __global const float* const source = strip.source;
    __global float* target = strip.target;

    float sum[PLANES];
    for (int k = 0; k < PLANES; ++k)
        sum[k] = 0.0f;
    const uint found = found_around(tiles, &p, strip.across, strip.down, s.pad, (uint)s.layer);
    if (found == 0) // and nobody reads it
        return;
#if !FILL
    if (found == 1) {
        for (int x = strip.first; x < strip.end; x += 16, target += 16) {
            float16 value = 0.0f;
            for (uint i = 0; i < s.pitch && x >= 0 && x < (int)p.columns; ++i)
                value += behind_either(source + (size_t)i * p.stride + x, s.layer, &p);
            *(__global float16_anywhere*)(target + s.strip_plane) = running(value, &sum[1]);
        }
        target[s.strip_plane] = sum[1];
        return;
    }
#endif
    for (int x = strip.first; x < strip.end; x += 16, target += 16) {
        float16 value[PLANES];
        for (int k = 0; k < PLANES; ++k)
            value[k] = 0.0f;
        if (x >= 0 && x < (int)p.columns) {
            for (uint i = 0; i < s.pitch; ++i)
                add_pixels(value, source + (size_t)i * p.stride + x, s.layer, 0.0f, &p);
        }
        for (int k = 0; k < PLANES; ++k)
            *(__global float16_anywhere*)(target + k * s.strip_plane) = running(value[k], &sum[k]);
    }
    for (int k = 0; k < PLANES; ++k)
        target[k * s.strip_plane] = sum[k];
}
