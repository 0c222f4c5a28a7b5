// Running sums along the rows of one layer as in dof_strips.cl, for dof_parts.cl. Pixels have a second surface, and there is a
// last sum: the columns of the layer's own pixels. The second surface counts only where the first lies some layers before this
// one. Otherwise both are seen through nearly the same part of the lens, and of that the first has left nothing.
// All sums up to a pixel lie side by side, for dof_parts.cl reads them at other columns for every pixel.
// Built for: BRIGHT = 0 1

#define FILL 0
#define BEHIND 1
#define MOMENT 1
#include "dof/layer.h"
#include "dof/parts.h"
#include "dof/running.h"

// One of WIDTH rounds that bring sums of 16 pixels into the order of pixels: the first and the second half of them, in turn.
INLINE void interleave(float16* sum) {
    float16 next[WIDTH];
    for (int i = 0; i < WIDTH / 2; ++i) {
        const float16 a = sum[i], b = sum[i + WIDTH / 2];
        next[2 * i] =
            (float16)(a.s0, b.s0, a.s1, b.s1, a.s2, b.s2, a.s3, b.s3, a.s4, b.s4, a.s5, b.s5, a.s6, b.s6, a.s7, b.s7);
        next[2 * i + 1] =
            (float16)(a.s8, b.s8, a.s9, b.s9, a.sa, b.sa, a.sb, b.sb, a.sc, b.sc, a.sd, b.sd, a.se, b.se, a.sf, b.sf);
    }
    for (int i = 0; i < WIDTH; ++i)
        sum[i] = next[i];
}

KERNEL void dof_part_strips(__global const float* planes, __global const uint* list, __global float* strips,
                              const blur_params p, const layer_params s) {
    const uint index = get_global_id(0), row = get_global_id(1);
    if (index >= s.tiles)
        return;
    const strip_row strip = strip_row_of(planes, list, strips, &p, &s, index, row);
    __global const float* const source = strip.source;
    __global float* target = strip.target;
    const float16 columns =
        (float16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15) - (float)(strip.across * dof_tile_columns);

    float sum[PLANES];
    for (int k = 0; k < PLANES; ++k)
        sum[k] = 0.0f;
    for (int x = strip.first; x < strip.end; x += 16, target += 16 * WIDTH) {
        float16 value[PLANES], before[WIDTH];
        for (int k = 0; k < PLANES; ++k)
            value[k] = 0.0f;
        if (x >= 0 && x < (int)p.columns) {
            for (uint i = 0; i < s.pitch; ++i)
                add_pixels(value, source + (size_t)i * p.stride + x, s.layer, columns + (float)x, &p);
        }
        for (int k = 0; k < PLANES; ++k)
            before[k] = running(value[k], &sum[k]);
        before[PLANES] = before[0];
        for (int k = PLANES + 1; k < WIDTH; ++k)
            before[k] = 0.0f;
        for (int i = 1; i < WIDTH; i *= 2)
            interleave(before);
        for (int i = 0; i < WIDTH; ++i)
            *(__global float16_anywhere*)(target + 16 * i) = before[i];
    }
    for (int k = 0; k < PLANES; ++k)
        target[k] = sum[k];
    target[PLANES] = sum[0];
}
