// One layer of circle of confusion through what those before it leave of the lens, and which part that is.
//   T    fraction of the lens that is left;  M  its first moment, in lens coordinates (u, v)
//   the half-plane n u >= d that leaves T of the aperture open, n along M, has the greatest moment there is: its fraction
//   of T is |M| / that, and what is left of T is spread evenly over the lens
//   alpha, colour and moment of a layer are sums over either part of the aperture, as in dof_gather.cl
// A straight edge before another is exact, whatever their circles. What is left in between, as before a pole, is between the
// half-plane and the even spread.
// Pixels have a second surface (dof_behind.cl), so that rays which pass an edge find what lies behind. It counts as in
// dof_part_strips.cl.
// Built for: BRIGHT = 0 1; DIRECT = 0 1

#include "dof/parts.h"
#include "dof/tiles.h"

#if !defined(DIRECT) || !defined(BRIGHT)
#error                                                                                                                 \
    "DIRECT and BRIGHT are not defined: 1 to read pixels instead of strips, and where strips hold what lies beyond the\
 knee, 0 otherwise"
#endif
#define COLORS 2
#define HIGHLIGHTS (2 + CHANNELS)
#define MOMENT (HIGHLIGHTS + BRIGHT * CHANNELS) // of the own along u
#define PLANES (MOMENT + 1)
#define MOMENT_DOWN PLANES // and along v
#define SUMS (PLANES + 1)

#define LINES 4 // that a row is cut into along the half-plane's border
#if DIRECT
#define EMPTY 1e-9f
#else
#define EMPTY 1e-3f // what a cut leaves of running sums may be their rounding
#endif
#define LEAST 1e-4f // of the lens: a smaller part, left or covered, is taken for none

typedef struct {
    floatV fraction; // of what is left of the lens, 0 to 1
    floatV n_u, n_v, d;
} lens_part;

// A builtin would be left to the driver: mix() may fuse its product or not.
INLINE float4 interpolated(float4 a, float4 b, float part) {
    return a + (b - a) * part;
}

// The half-plane that goes with what is left: `table` holds for each direction of M and fraction left how far n is turned
// from M (cosine, sine), d, and the greatest moment.
INLINE lens_part part_left(floatV left, floatV u, floatV v, __global const float4* table, uint directions) {
    const floatV size = sqrt(fma(u, u, v * v));
    const intV some = (left > LEAST) & (left < 1.0f - LEAST) & (size > 1e-6f);
    const floatV along_u = select((floatV)1.0f, u / size, some), along_v = select((floatV)0.0f, v / size, some);
    lens_part open = {0.0f, along_u, along_v, 0.0f};
    if (!any_of(some))
        return open;
    float turn_u[V], turn_v[V], distance[V], greatest[V];
    const float_lanes us = along_u, vs = along_v, lefts = select((floatV)0.5f, left, some);
    for (int i = 0; i < V; ++i) {
        const float a = ((const float*)&us)[i], b = ((const float*)&vs)[i];
        const float around = b / (fabs(a) + fabs(b)), quarter = a < 0.0f ? 2.0f - around : around; // -1 to 3
        const float which = directions > 1 ? (quarter + 1.0f) * 0.25f * (float)directions : 0.0f;
        const uint first = min((uint)which, directions - 1), next = first + 1 < directions ? first + 1 : 0;
        const float between = which - (float)first;
        const float at = ((const float*)&lefts)[i] * (dof_fractions - 1);
        const uint low = min((uint)at, (uint)dof_fractions - 2);
        const float part = at - (float)low;
        const float4 one =
            interpolated(table[first * dof_fractions + low], table[first * dof_fractions + low + 1], part);
        const float4 two = interpolated(table[next * dof_fractions + low], table[next * dof_fractions + low + 1], part);
        const float4 found = interpolated(one, two, between);
        turn_u[i] = found.x;
        turn_v[i] = found.y;
        distance[i] = found.z;
        greatest[i] = found.w;
    }
    const floatV c = *(const float_lanes*)turn_u, s = *(const float_lanes*)turn_v;
    open.fraction = select((floatV)0.0f, min(size / *(const float_lanes*)greatest, 1.0f), some);
    open.n_u = along_u * c - along_v * s;
    open.n_v = along_u * s + along_v * c;
    open.d = *(const float_lanes*)distance;
    return open;
}

#if DIRECT
// Sums over the whole aperture and over the half-plane's part of it.
INLINE void add_pixels(__global const float* here, int x, int y, __global const aperture_tap_params* taps,
                       const blur_params* p, float layer, const part_params* part, const lens_part* open,
                       bool second_surfaces, bool halves, floatV* even, floatV* cut) {
    taps += part->taps;
    for (uint i = 0, next; i < part->tap_count; i = next) {
        const int column = taps[i].column, row = taps[i].row;
        const bool inside_image = y + row >= 0 && y + row < (int)p->rows;
        float weight = 0.0f, weight_u = 0.0f, weight_v = 0.0f; // of all parts of a pixel, and their moments
        floatV open_weight = 0.0f, open_u = 0.0f, open_v = 0.0f;
        for (next = i; next < part->tap_count && taps[next].column == column && taps[next].row == row; ++next) {
            const aperture_tap_params tap = taps[next];
            weight += tap.weight;
            weight_u = fma(tap.weight, tap.u, weight_u);
            weight_v = fma(tap.weight, tap.v, weight_v);
            if (!halves)
                continue;
            const floatV inside = fma(open->n_u, (floatV)tap.u, fma(open->n_v, (floatV)tap.v, -open->d));
            const floatV fraction = tap.weight * min(max(fma(inside, (floatV)part->radius, (floatV)0.5f), 0.0f), 1.0f);
            open_weight += fraction;
            open_u = fma(fraction, (floatV)tap.u, open_u);
            open_v = fma(fraction, (floatV)tap.v, open_v);
        }
        if (!inside_image)
            continue;
        __global const float* from = here + (long)row * (long)p->stride + column;
        const floatV off = LOAD(float, from) - layer, own = max(1.0f - fabs(off), 0.0f);
        floatV value[MOMENT];
        value[0] = own;
        value[1] = min(max(off + 2.0f, 0.0f), 1.0f);
#pragma unroll
        for (int k = 0; k < CHANNELS; ++k)
            value[COLORS + k] = own * LOAD(float, from + (k + 1) * p->plane);
        if (second_surfaces) {
            __global const float* second = from + (1 + CHANNELS) * p->plane;
            const floatV off_second = LOAD(float, second) - layer;
            const floatV open_second = min(max((-off - JUMP) * (1.0f / SLOPE), 0.0f), 1.0f);
            const floatV own_second = open_second * max(1.0f - fabs(off_second), 0.0f);
            value[0] += own_second;
            value[1] = max(value[1], open_second * min(max(off_second + 2.0f, 0.0f), 1.0f));
#pragma unroll
            for (int k = 0; k < CHANNELS; ++k)
                value[COLORS + k] = fma(own_second, LOAD(float, second + (k + 1) * p->plane), value[COLORS + k]);
        }
        if (p->areas) {
            const floatV area = LOAD(float, from + p->areas);
#pragma unroll
            for (int k = 0; k < MOMENT; ++k)
                value[k] *= area;
        }
#pragma unroll
        for (int k = 0; k < MOMENT; ++k)
            even[k] = fma((floatV)weight, value[k], even[k]);
        even[MOMENT] = fma((floatV)weight_u, value[0], even[MOMENT]);
        even[MOMENT_DOWN] = fma((floatV)weight_v, value[0], even[MOMENT_DOWN]);
        if (!halves)
            continue;
#pragma unroll
        for (int k = 0; k < MOMENT; ++k)
            cut[k] = fma(open_weight, value[k], cut[k]);
        cut[MOMENT] = fma(open_u, value[0], cut[MOMENT]);
        cut[MOMENT_DOWN] = fma(open_v, value[0], cut[MOMENT_DOWN]);
    }
}
#else
#define SUMS_AT(pointer) (*(__global const sums_of_pixel*)(pointer))
#define FLOATS_AT(pointer) (*(__global const floats_of_pixels*)(pointer))
#if V * WIDTH < 16
typedef float8 several;
#define SEVERAL 8
#else
typedef float16 several;
#define SEVERAL 16
#endif
#define VECTORS (V * WIDTH / SEVERAL)
typedef several __attribute__((aligned(4))) floats_of_pixels;

// The half-planes of V pixels, as rows cut them.
typedef struct {
    intV right; // does it open to the right?
    floatV n_v, d, inverse;
} row_cut;

// Adds one row of strips over the whole aperture around V pixels, which lie side by side in vectors.
INLINE void add_row(__global const float* from, __global const span_params* span, __global const span_params* last,
                    several scale, several* even) {
    several whole[VECTORS];
#pragma unroll
    for (int i = 0; i < VECTORS; ++i)
        whole[i] = 0.0f;
    for (; span < last; ++span) {
        __global const float* low = from + span->low * WIDTH;
        __global const float* high = from + span->high * WIDTH;
        const several weight = span->weight;
#pragma unroll
        for (int i = 0; i < VECTORS; ++i)
            whole[i] = fma(weight, FLOATS_AT(high + SEVERAL * i) - FLOATS_AT(low + SEVERAL * i), whole[i]);
    }
#pragma unroll
    for (int i = 0; i < VECTORS; ++i)
        even[i] = fma(whole[i], scale, even[i]);
}

// Adds one row of strips whose middle lies `away` pixels down: over the half-planes' parts of the aperture around these `count`
// of V pixels.
INLINE void add_cut(__global const float* from, __global const span_params* span, __global const span_params* last,
                    float away, float pitch, const part_params* part, const row_cut* open, const int* pixels, int count,
                    floatW* cut) {
    // Rounded with a different remainder on each line, so that their mean is not.
    const float rest[LINES] = {0.5f / LINES, 2.5f / LINES, 1.5f / LINES, 3.5f / LINES};
    intV border[LINES];
#pragma unroll
    for (int line = 0; line < LINES; ++line) {
        const float down = (away + (((float)line + 0.5f) / LINES - 0.5f) * pitch) * part->down;
        const floatV edge = fma(fma(-open->n_v, (floatV)down, open->d), open->inverse, (floatV)0.5f) + rest[line];
        border[line] = convert_intV(floor(min(max(edge, (floatV)-1e4f), (floatV)1e4f)));
    }
    floatW of_cut[V];
    for (int n = 0; n < count; ++n)
        of_cut[n] = 0.0f;
    const intV first = LANE_INDEX(int) * WIDTH;
    for (; span < last; ++span) {
        int at[LINES + 1][V];
        float weights[V];
#pragma unroll
        for (int line = 0; line < LINES; ++line)
            *(int_lanes*)at[line] = clamp(border[line], (intV)span->low, (intV)span->high) * WIDTH + first;
        *(int_lanes*)at[LINES] = select((intV)span->low, (intV)span->high, open->right) * WIDTH + first;
        *(float_lanes*)weights = select((floatV)span->weight, (floatV)-span->weight, open->right);
        for (int n = 0; n < count; ++n) {
            const int i = pixels[n];
            const floatW middle = ((SUMS_AT(from + at[0][i]) + SUMS_AT(from + at[1][i])) +
                                   (SUMS_AT(from + at[2][i]) + SUMS_AT(from + at[3][i]))) *
                                  (1.0f / LINES);
            of_cut[n] = fma((floatW)weights[i], middle - SUMS_AT(from + at[LINES][i]), of_cut[n]);
        }
    }
    floatW scale = 1.0f;
    ((float*)&scale)[MOMENT_DOWN] = away * part->down;
    for (int n = 0; n < count; ++n)
        cut[n] = fma(of_cut[n], scale, cut[n]);
}
#endif

KERNEL void dof_parts(__global const float* source, __global const uint* list, __global const uint* starts,
                      __global const float* tables, __global const float* halves, __global float* state,
                      const blur_params p, const layer_params s, const part_params part) {
    const uint item = get_global_id(0), x = item % (dof_tile_columns / V) * V;
    const uint index = item / (dof_tile_columns / V) / dof_tile_rows;
    if (index >= s.tiles)
        return;
    const uint entry = list[s.list + index], across = ENTRY_ACROSS(entry), down = ENTRY_DOWN(entry);
    const int y = (int)(down * dof_tile_rows + item / (dof_tile_columns / V) % dof_tile_rows);
    const size_t at = in_planes(&p, across, x, y);
    __global float* here = state + in_state(&p, at);
    __global float* before = here + (2 * CHANNELS + 2) * p.state_plane;
    __global float* moment = before + p.state_plane;
    __global float* moment_before = moment + 2 * p.state_plane;

    const bool follows = entry & ENTRY_FOLLOWS;
    const floatV through = LOAD(float, here), u = LOAD(float, moment), v = LOAD(float, moment + p.state_plane);
    if (!any_of(through > 0.0f))
        return;
    const floatV left = follows ? LOAD(float, before) : through;
    const floatV left_u = follows ? LOAD(float, moment_before) : u;
    const floatV left_v = follows ? LOAD(float, moment_before + p.state_plane) : v;
    *(__global float_lanes*)before = through;
    *(__global float_lanes*)moment_before = u;
    *(__global float_lanes*)(moment_before + p.state_plane) = v;

#if DIRECT
    __global const float* column = source + at - (size_t)y * p.stride;
    const layer_range around = layers_within(column, &p, y - s.reach, y + s.reach + 1, s.columns, 2);
    if (s.layer <= around.least - 1.0f || s.layer >= around.greatest + 1.0f)
        return;
    const layer_range second =
        layers_within(column + (1 + CHANNELS) * p.plane, &p, y - s.reach, y + s.reach + 1, s.columns, 1);
#else
    const int pitch = (int)s.pitch, rows = (int)p.rows / pitch, height = 2 * s.reach + 1;
    const int begin = max(y / pitch - s.reach, 0), end = min(y / pitch + s.reach + 1, rows);
    const int first = (int)(s.first * dof_tile_rows) / pitch;
    __global const float* block =
        source + (size_t)(across - s.first_column) * s.strip_column + (size_t)(s.pad + x) * WIDTH;
    bool own = false;
    for (int row = begin; row < end && !own; ++row) {
        __global const float* sum = block + (size_t)(row - first) * s.strip_row;
        own = sum[(V + s.columns) * WIDTH] > sum[-s.columns * WIDTH];
    }
    if (!own)
        return;
#endif

    floatV even[SUMS], cut[SUMS];
#pragma unroll
    for (int k = 0; k < SUMS; ++k)
        even[k] = cut[k] = 0.0f;
    lens_part open = part_left(left, left_u, left_v, (__global const float4*)halves, part.directions);
    if (part.single)
        open.fraction = 0.0f;
#if DIRECT
    add_pixels(source + at, (int)x, y, (__global const aperture_tap_params*)tables, &p, s.layer, &part, &open,
               second.greatest >= 0.0f, any_of(open.fraction > 0.0f), even, cut);
#else
    __global const span_params* spans = (__global const span_params*)tables;
    starts += (long)s.starts + y % pitch * height - y / pitch + s.reach; // of row 0
    several wholes[VECTORS];
#pragma unroll
    for (int i = 0; i < VECTORS; ++i)
        wholes[i] = 0.0f;
    for (int row = begin; row < end; ++row) {
        several scale = 1.0f;
        const float away = ((float)(row * pitch - y) + 0.5f * (float)(pitch - 1)) * part.down;
        for (int i = MOMENT_DOWN; i < SEVERAL; i += WIDTH)
            ((float*)&scale)[i] = away;
        add_row(block + (size_t)(row - first) * s.strip_row, spans + starts[row], spans + starts[row + 1], scale,
                wholes);
    }
    float even_of[WIDTH][V], cut_of[WIDTH][V];
    for (int i = 0; i < V; ++i)
#pragma unroll
        for (int k = 0; k < WIDTH; ++k)
            even_of[k][i] = ((const float*)wholes)[i * WIDTH + k];
    // A part has no more of the layer's own than the whole has, but for rounding.
    const int_lanes has_part =
        (through > 0.0f) & (open.fraction > 0.0f) & (*(const float_lanes*)even_of[0] > 0.5f * EMPTY);
    int pixels[V], count = 0;
    for (int i = 0; i < V; ++i)
        if (((const int*)&has_part)[i])
            pixels[count++] = i;
    floatW cuts[V];
    for (int n = 0; n < count; ++n)
        cuts[n] = 0.0f;
    if (count > 0) {
        const floatV slope = open.n_u * part.across, steepest = (floatV)1e-9f;
        row_cut open_here = {slope > 0.0f, open.n_v, open.d, 0.0f};
        open_here.inverse = 1.0f / select(min(slope, -steepest), max(slope, steepest), open_here.right);
        for (int row = begin; row < end; ++row)
            add_cut(block + (size_t)(row - first) * s.strip_row, spans + starts[row], spans + starts[row + 1],
                    (float)(row * pitch - y) + 0.5f * (float)(pitch - 1), (float)pitch, &part, &open_here, pixels,
                    count, cuts);
    }
    for (int k = 0; k < WIDTH; ++k)
        *(float_lanes*)cut_of[k] = (floatV)0.0f;
    for (int n = 0; n < count; ++n)
        for (int k = 0; k < WIDTH; ++k)
            cut_of[k][pixels[n]] = ((const float*)&cuts[n])[k];
#pragma unroll
    for (int k = 0; k < SUMS; ++k) {
        even[k] = *(const float_lanes*)even_of[k];
        cut[k] = *(const float_lanes*)cut_of[k];
    }
    const floatV middle = vector_from(x) - 0.5f;
    even[MOMENT] = fma(-middle, even[0], even[MOMENT]) * part.across;
    cut[MOMENT] = fma(-middle, cut[0], cut[MOMENT]) * part.across;
#endif
    if (part.single) {
        even[MOMENT] = even[0] * (left_u / max(left, 1e-9f));
        even[MOMENT_DOWN] = even[0] * (left_v / max(left, 1e-9f));
    }

    const intV some = even[0] > EMPTY, some_cut = (cut[0] > EMPTY) & (open.fraction > 0.0f);
#if !DIRECT
    even[1] = max(even[1], RUNNING_LEAST);
    cut[1] = max(cut[1], RUNNING_LEAST);
#endif
    const floatV seen_even = select((floatV)0.0f, left * (1.0f - open.fraction) * (even[0] / even[1]), some);
    const floatV seen_cut = select((floatV)0.0f, left * open.fraction * (cut[0] / cut[1]), some_cut);
    const floatV seen = seen_even + seen_cut, rest = through - min(seen, through);
    const floatV scale = select((floatV)0.0f, (through - rest) / seen, seen > 0.0f); // as much as T loses once it is rounded
    const floatV of_even = select((floatV)0.0f, seen_even * scale / even[0], some);
    const floatV of_cut = select((floatV)0.0f, seen_cut * scale / cut[0], some_cut);
    *(__global float_lanes*)here = rest;
    *(__global float_lanes*)moment = u - fma(of_even, even[MOMENT], of_cut * cut[MOMENT]);
    *(__global float_lanes*)(moment + p.state_plane) = v - fma(of_even, even[MOMENT_DOWN], of_cut * cut[MOMENT_DOWN]);
#pragma unroll
    for (int k = 0; k < CHANNELS; ++k) {
#if BRIGHT
        const floatV light = even[COLORS + k] + even[HIGHLIGHTS + k], light_cut = cut[COLORS + k] + cut[HIGHLIGHTS + k];
#else
        const floatV light = even[COLORS + k], light_cut = cut[COLORS + k];
#endif
        __global float* to = here + (k + 1) * p.state_plane;
#if DIRECT
        *(__global float_lanes*)to = fma(of_even, light, fma(of_cut, light_cut, LOAD(float, to)));
#else
        *(__global float_lanes*)to =
            fma(of_even, of_running(light), fma(of_cut, of_running(light_cut), LOAD(float, to)));
#endif
    }
}
