// Circles become layers and colours become planes, cut into tiles: what the passes of dof read.
//   s = middle + sign(c) n (L(|c| + o) - L(1 + o)),  L(2^i (1 + t)) = i + t + b t (1 - t),  n layers an octave
// A pixel lies in the two layers around s, the nearer one the more; s is a multiple of 1/512, so that the two fractions,
// and any sum of them, are exact. A pixel without a circle, or with a colour that is NaN, takes part in no layer.
// The circles stand where the layers will. Every pixel has an area of 1, until dof_unmix.cl takes some apart.
// Under CLEAN_PLATE the circles and colours are those of a clean plate: where it lies behind the picture, it is the
// pixel's second surface.
// Built for: CLEAN_PLATE = 0 1

#include "vector.h"
#include "pixels.h"
#include "dof/tiles.h"

#ifndef CLEAN_PLATE
#error "CLEAN_PLATE is not defined: 1 for what lies behind the picture, 0 for the picture"
#endif
#define LARGEST_COLOR 1e30f // running sums of it stay finite

KERNEL void dof_planes(__global const ELEMENT_TYPE* color, __global float* planes, const grid_params color_grid,
                         const blur_params p) {
    const uint column = get_global_id(0) * V, row = get_global_id(1);
    if (column >= p.stride)
        return;
    const int x = (int)column - dof_margin - (int)p.left, y = (int)row - (int)p.top;
    const size_t here = (size_t)row * p.stride + column;
#if CLEAN_PLATE
    __global float* target = planes + (1 + CHANNELS) * p.plane + here;
#else
    __global float* target = planes + here;
#endif
    uint in_image[V];
    float channel[CHANNELS][V];
    for (int i = 0; i < V; ++i) {
        const bool there = y >= 0 && y < (int)p.height && x + i >= 0 && x + i < (int)p.width;
        const size_t nth = there ? x + i : 0, line = there ? y : 0;
        in_image[i] = there ? ~0u : 0;
        const size_t at = color_grid.source_offset + line * color_grid.source_stride + CHANNELS * nth;
        for (int k = 0; k < CHANNELS; ++k)
            channel[k][i] = read_element(color, at + k);
    }

    const floatV c = LOAD(float, target);
    intV known = (c == c) & as_intV(*(const uint_lanes*)in_image);
    floatV value[CHANNELS];
    for (int k = 0; k < CHANNELS; ++k) {
        value[k] = *(const float_lanes*)channel[k];
        known &= fabs(value[k]) <= LARGEST_COLOR;
    }
    const floatV size = min(max(fabs(c), 1.0f), p.largest) + p.offset;
    const floatV part = convert_floatV(as_intV(size) & 0x7fffff) * 0x1p-23f; // of an octave
    const floatV whole = convert_floatV(as_intV(size) - as_intV((floatV)(1.0f + p.offset))) * 0x1p-23f;
    const floatV octaves = fma(p.bend * part, 1.0f - part, whole);
    const floatV away = convert_floatV(convert_intV(fma(octaves, (floatV)(512.0f * p.per_octave), (floatV)0.5f))) * 0x1p-9f;
    const floatV layer = (float)p.middle + select(away, -away, c < 0.0f);
#if CLEAN_PLATE
    const floatV front = LOAD(float, planes + here);
    known &= (front >= 0.0f) & (layer > front + JUMP);
#endif
    *(__global float_lanes*)target = select((floatV)NOWHERE, layer, known);
    for (int k = 0; k < CHANNELS; ++k)
        *(__global float_lanes*)(target + (k + 1) * p.plane) = select((floatV)0.0f, value[k], known);
#if !CLEAN_PLATE
    *(__global float_lanes*)(target + p.areas) = (floatV)1.0f;
#endif
}
