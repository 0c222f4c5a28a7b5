// One layer of the depth of field: what a pixel counts in it, and how it is laid over those before it.
//   seen = T O / (O + B),  colour += seen (mean of the layer's own),  T <- T - seen
// O and B are sums over the aperture: of the layer's own pixels, and of those behind it.

#ifndef FATHOM_LAYER_H
#define FATHOM_LAYER_H

#include "dof/tiles.h"

#if !defined(FILL) || !defined(BRIGHT) || !defined(BEHIND) || !defined(MOMENT)
#error "FILL, BRIGHT, BEHIND and MOMENT are not defined: 1 to sum what lies behind, what lies beyond the knee apart, the\
 second surface of a pixel, and columns, 0 otherwise; BEHIND is 2 where that surface is a guess"
#endif
#define HIGHLIGHTS (2 + CHANNELS + FILL * (2 + CHANNELS))
#define HIDDEN_HIGHLIGHTS (HIGHLIGHTS + CHANNELS) // under FILL and BRIGHT
#define PLANES (HIGHLIGHTS + BRIGHT * CHANNELS * (1 + FILL) + MOMENT)

#ifndef RUNNING
#define RUNNING 0 // 1 where sums are differences of running sums
#endif
#define KNOWN 0.1667f // of an aperture: where less is known, a layer does not stand for all that the foreground hides

// Under BEHIND 2 a second surface may be a guess. Behind a blurred foreground it counts wholly where it is as blurred as that,
// and by half where its circle is a good deal smaller: it would end hard where another surface is the nearest. The rest of T is
// left to what lies farther away, or to the mean. Where the foreground's circle is so large that too much of it would be
// looked through, nothing is guessed.
#define LEAST_OF_GUESS 0.55f
#define OPEN_BEHIND(first, second, p) (1.0f - IS_GUESS(second) * (1.0f - HIDES(first, p)))
#define COUNTED_BEHIND(open, second, layer, p)                                                                         \
    (open * (1.0f - IS_GUESS(second) * (1.0f - of_guess(layer, p))))

INLINE float of_guess(float layer, const blur_params* p) {
    return min(fma(1.0f - LEAST_OF_GUESS, fabs(layer - (float)p->middle) * (4.0f / p->per_octave), LEAST_OF_GUESS), 1.0f);
}

// 16 pixels at once, whatever V is: the order of a sum decides its bits.
typedef float16 __attribute__((aligned(4))) float16_anywhere;
#define LOAD_16(pointer) (*(__global const float16_anywhere*)(pointer))

// Adds a channel of a surface to sum `to`, weighted by `own`; the part beyond the knee is summed apart, in `highlights`.
INLINE void add_color(float16* value, int to, int highlights, float16 own, float16 color, float knee) {
#if BRIGHT
    const float16 base = min(max(color, -knee), knee);
    value[highlights] = fma(own, color - base, value[highlights]);
#else
    const float16 base = color;
#endif
    value[to] = fma(own, base, value[to]);
}

// What a pixel counts is rounded to 1/512, as layers are: sums of it are exact, so differences of running sums are, too. What
// they leave of the rounding of other sums would pass for a weight.
INLINE float16 in_steps(float16 part) {
    return convert_float16(convert_int16(fma(part, (float16)512.0f, (float16)0.5f))) * 0x1p-9f;
}

// A part of 16 pixels, as much as they have an area.
INLINE float16 of_area(float16 part, __global const float* here, const blur_params* p) {
    return p->areas ? in_steps(LOAD_16(here + p->areas) * part) : part;
}

// The weight of a pixel that lies `off` layers behind this one, or in it.
INLINE float16 behind_layer(float16 off) {
    return min(max(off + 2.0f, 0.0f), 1.0f);
}

INLINE bool any_of_16(int16 condition) {
    const int8 half_of = condition.lo | condition.hi;
    const int4 quarter = half_of.lo | half_of.hi;
    const int2 pair = quarter.lo | quarter.hi;
    return (pair.x | pair.y) != 0;
}

#if BEHIND
#define SECOND(here, p) ((here) + (1 + CHANNELS) * (p)->plane)
#endif

// What 16 pixels of a row count as behind a layer, or in it: of either surface, if they have two.
INLINE float16 behind_either(__global const float* here, float layer, const blur_params* p) {
    const float16 first = LOAD_16(here);
    float16 behind = behind_layer(first - layer);
#if BEHIND
    const float16 second = LOAD_16(SECOND(here, p));
#endif
#if BEHIND == 2
    if (any_of_16(second > layer - 2.0f))
        behind = max(behind, in_steps(OPEN_BEHIND(first, second, p) * behind_layer(second - layer)));
#elif BEHIND
    behind = max(behind, behind_layer(second - layer));
#endif
    return of_area(behind, here, p);
}

// How many layers behind a layer those pixels begin that it may hide and that are sharper. Its own surface goes on in the next
// layer, but that of the focus has an aperture of a pixel: it never reaches around what hides it.
INLINE float sharper_from(float layer, const blur_params* p) {
    return layer == (float)p->middle - 1.0f ? 0.0f : 1.0f;
}

// Adds what 16 pixels of a row count for a layer. `columns` are their numbers, used under MOMENT.
INLINE void add_pixels(float16* value, __global const float* here, float layer, float16 columns, const blur_params* p) {
    const float16 first = LOAD_16(here), off = first - layer;
    const float16 own = of_area(max(1.0f - fabs(off), 0.0f), here, p);
    float16 behind = behind_layer(off), all = own;
#if BEHIND
    __global const float* second = SECOND(here, p);
    const float16 its = LOAD_16(second);
    float16 own_second = 0.0f;
    if (BEHIND == 1 || any_of_16(its > layer - 2.0f)) {
        const float16 off_second = its - layer;
#if BEHIND == 2
        const float16 open = OPEN_BEHIND(first, its, p), counted = COUNTED_BEHIND(open, its, layer, p);
#elif MOMENT
        const float16 open = min(max((-off - JUMP) * (1.0f / SLOPE), 0.0f), 1.0f), counted = open;
#else
        const float16 open = 1.0f, counted = open;
#endif
        behind = max(behind, in_steps(open * behind_layer(off_second)));
        own_second = of_area(in_steps(counted * max(1.0f - fabs(off_second), 0.0f)), here, p);
        all += own_second;
    }
#endif
    value[0] += all;
    value[1] += of_area(behind, here, p);
#if MOMENT
    value[PLANES - 1] = fma(all, columns, value[PLANES - 1]);
#endif
#if FILL
    const float alike = 2.0f * ((float)p->middle - layer); // layers on, circles are as large again
    const float16 sharper =
        of_area(min(max(min(off - sharper_from(layer, p), alike - off), 0.0f), 1.0f), here, p);
    value[2 + CHANNELS] += sharper;
    value[3 + 2 * CHANNELS] += of_area(min(max(off - alike + 1.0f, 0.0f), 1.0f), here, p);
#endif
    for (int k = 0; k < CHANNELS; ++k) {
        const float16 color = LOAD_16(here + (k + 1) * p->plane);
        add_color(value, 2 + k, HIGHLIGHTS + k, own, color, p->knee);
#if FILL
        add_color(value, 3 + CHANNELS + k, HIDDEN_HIGHLIGHTS + k, sharper, color, p->knee);
#endif
    }
#if BEHIND
    if (BEHIND == 1 || any_of_16(own_second > 0.0f))
        for (int k = 0; k < CHANNELS; ++k)
            add_color(value, 2 + k, HIGHLIGHTS + k, own_second, LOAD_16(second + (k + 1) * p->plane), p->knee);
#endif
}

// Lays the layer's part of a row of pixels over what was seen before it.
// `known` is not 0 where the pixel itself belongs to the foreground. It is the part of what the layer covers that it is known
// to: where an aperture hardly reaches beyond what hides it, another surface beside may go on there as well.
// `wide` is not 0 where the pixel itself belongs to the foreground, its circle is smaller than the layer's, and no
// clean plate shows what the foreground hides. It is 1 from one layer of difference on.
INLINE void composite(__global float* here, uint plane, bool follows, const floatV* sum, const floatV* known,
                      const floatV* wide) {
    __global float* before = here + (2 * CHANNELS + 2) * plane;
    __global float* left_to_wide = before + plane;
    const floatV through = LOAD(float, here);
    const floatV through_far = follows ? LOAD(float, before) : through;
    *(__global float_lanes*)before = through;
    const intV some = (sum[0] > 0.0f) & (through > 0.0f);
    if (!any_of(some))
        return;
    floatV seen = select((floatV)0.0f, min(through, through_far * (sum[0] / (RUNNING ? max(sum[1], RUNNING_LEAST) : sum[1]))), some);
    if (known)
        seen *= *known;
    if (wide) {
        const floatV left = LOAD(float, left_to_wide);
        seen = fma(*wide, min(seen, max(left, 0.0f)) - seen, seen);
        *(__global float_lanes*)left_to_wide = fma(-*wide, seen, left);
    }
    // As much as T loses once it is rounded: in the end 1 - T is what was seen in all, however little that is.
    const floatV rest = through - seen;
    seen = through - rest;
    const floatV fraction = select((floatV)0.0f, seen / sum[0], some);
    *(__global float_lanes*)here = rest;
    for (int k = 0; k < CHANNELS; ++k) {
        __global float* to = here + (k + 1) * plane;
#if BRIGHT
        const floatV color = sum[2 + k] + sum[HIGHLIGHTS + k];
#else
        const floatV color = sum[2 + k];
#endif
        *(__global float_lanes*)to = fma(fraction, RUNNING ? of_running(color) : color, LOAD(float, to));
    }
#if FILL
    // What is left to wide circles is the mean over the layers of the foreground, each weighted by what is seen of it.
    const floatV left = LOAD(float, left_to_wide), wider = through_far * (sum[3 + 2 * CHANNELS] / sum[1]);
    const floatV part = select((floatV)0.0f, seen / (1.0f - rest), rest < 1.0f);
    const intV first = left == INFINITY;
    *(__global float_lanes*)left_to_wide = select(left, select(fma(wider - left, part, left), wider, first), some);
    __global float* hidden = here + (CHANNELS + 1) * plane;
    const floatV share = select((floatV)0.0f, seen / sum[1], some); // a layer that is hardly seen hides hardly anything
    *(__global float_lanes*)hidden = fma(share, sum[2 + CHANNELS], LOAD(float, hidden));
    for (int k = 0; k < CHANNELS; ++k) {
        __global float* to = hidden + (k + 1) * plane;
#if BRIGHT
        const floatV color = sum[3 + CHANNELS + k] + sum[HIDDEN_HIGHLIGHTS + k];
#else
        const floatV color = sum[3 + CHANNELS + k];
#endif
        *(__global float_lanes*)to = fma(share, RUNNING ? of_running(color) : color, LOAD(float, to));
    }
#endif
}

// A layer, and what is known of it in a tile.
typedef struct {
    __global const float* planes;
    const blur_params* p;
    float layer;
    bool follows, has_foreground;
} layer_at;

INLINE void lay(const layer_at* s, __global float* state, size_t at, const floatV* sum) {
    const float middle = (float)s->p->middle;
    const floatV own = LOAD(float, s->planes + at), alike = 2.0f * middle - own;
    floatV unknown = select((floatV)0.0f, (floatV)1.0f, own < middle); // how far is it unknown what lies behind the pixel?
#if BEHIND
    const floatV second = LOAD(float, s->planes + (1 + CHANNELS) * s->p->plane + at);
    unknown = select(unknown, (floatV)0.0f, (second >= 0.0f) & (IS_GUESS(second) == 0.0f));
#endif
    const floatV wide = unknown * min(max(s->layer - alike + 1.0f, 0.0f), 1.0f);
    const float circle = excess_of(s->layer, s->p) + 1.0f, enough = KNOWN * s->p->area * circle * circle;
    const floatV known = fma(unknown, min(sum[1] / enough, 1.0f), 1.0f - unknown);
    const bool limited = s->has_foreground && s->layer > middle;
    composite(state + in_state(s->p, at), s->p->state_plane, s->follows, sum, limited ? &known : 0, limited ? &wide : 0);
}

// Stores T for the next layer, which reads the T from before this layer. This layer adds nothing here.
INLINE void keep_open(__global float* here, const blur_params* p, int rows) {
    __global float* before = here + (2 * CHANNELS + 2) * p->state_plane;
    for (int i = 0; i < rows; ++i)
        *(__global float_lanes*)(before + i * p->stride) = LOAD(float, here + i * p->stride);
}

#endif
