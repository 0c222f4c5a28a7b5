// From a pinhole's result back to the pixels of the lens's image: of the four pixels around a ray, weighted bilinearly and by how
// near they lie to the pixel's tangent plane, as joint_upsample.cl does. Two faces' results are off by a few thousandths in
// opposite directions where their blocks meet, over many pixels: there they pass over into each other.
// Built for: LENS = 1; OUTPUT = 0 1 2

#include "camera/patch.h"
#include "faces/face.h"
#include "ssao/upsampled.h"

#define KNOWN 1e-3f // the weight of results on the pixel's plane from which on no other counts

// Where pixels of the lens are seen, in pixels from the face's axis.
typedef struct {
    floatV x, y;
} placesV;

// By the polynomial of the tile that pixel (x, y) of the camera lies in, for pixels x0 to x0 + V - 1 of the row.
INLINE placesV places_in_tile(__global const float* places, const face_params* p, uint x, uint x0, uint y) {
    __global const float8* const rows = (__global const float8*)places + 3 * ((y >> 4) * p->tiles + (x >> 4));
    const float8 row = (float8)((float)(y & 15));
    const float8 powers = fma(row, fma(row, rows[2], rows[1]), rows[0]);
    const floatV column = convert_floatV((intV)((int)x0 - (int)(x & ~15u)) + LANE_INDEX(int));
    return (placesV){fma(column, fma(column, (floatV)powers.s4, (floatV)powers.s2), (floatV)powers.s0),
                     fma(column, fma(column, (floatV)powers.s5, (floatV)powers.s3), (floatV)powers.s1)};
}

// `beside`: the block, where tiles have polynomials of other faces.
INLINE placesV places_on_face(__global const float* places, const face_params* p, const from_face_params* from,
                              intV beside, uint x, uint y, __global const uint* tiles, __global const float* nodes,
                             const lens_params* lens) {
    placesV found = places_in_tile(places, p, x, x, y);
    if ((x & 15) + V > 16) { // a region's vectors need not begin with a tile
        const uint next = (x | 15) + 1;
        const intV behind = (intV)(int)x + LANE_INDEX(int) >= (int)next;
        const placesV beyond = places_in_tile(places, p, next, x, y);
        found = (placesV){select(found.x, beyond.x, behind), select(found.y, beyond.y, behind)};
    }
    const intV none = isnan(found.x) | beside;
    if (!any_of(none))
        return found;
    const patch_rayV ray = patch_rays(tiles, nodes, lens, x, y);
    const floatV u[3] = {ray.x.high + ray.x.low, ray.y.high + ray.y.low, ray.z.high + ray.z.low};
    floatV part[3]; // right, down, ahead
    for (int i = 0; i < 3; ++i)
        part[i] = fma(u[0], (floatV)from->unit[0][i], fma(u[1], (floatV)from->unit[1][i], u[2] * from->unit[2][i]));
    const floatV scale = select((floatV)NAN, 1.0f / (part[2] * p->pixel), part[2] > from->least_ahead);
    return (placesV){select(found.x, part[0] * scale, none), select(found.y, part[1] * scale, none)};
}

typedef float2 __attribute__((aligned(4))) float2_lanes;

// Two neighbours in a row for each lane, from these elements on: the left ones and the right ones.
INLINE void pairs_at(__global const float* image, intV elements, floatV* left, floatV* right) {
    const int_lanes numbers = elements;
    const int* const at = (const int*)&numbers;
#define PAIR_AT(i) *(__global const float2_lanes*)(image + at[i])
#if V == 1
    const float2 pair = PAIR_AT(0);
    *left = pair.x, *right = pair.y;
#else
    float4 lefts[V / 4], rights[V / 4];
    for (int i = 0; i < V; i += 4) {
        const float8 four = (float8)(PAIR_AT(i), PAIR_AT(i + 1), PAIR_AT(i + 2), PAIR_AT(i + 3));
        lefts[i / 4] = four.even;
        rights[i / 4] = four.odd;
    }
    *left = *(const float_lanes*)lefts;
    *right = *(const float_lanes*)rights;
#endif
#undef PAIR_AT
}

// How many pixels these lie beside the block; 0 within it.
INLINE intV pixels_beside(const from_face_params* from, uint x, uint y) {
    const intV columns = (intV)(int)x + LANE_INDEX(int), across = max(from->left - columns, columns - (from->right - 1));
    return max(max(across, max(from->top - (int)y, (int)y - (from->bottom - 1))), (intV)0);
}

// What the face's results weigh beside those that were there before.
INLINE floatV fade_at(const from_face_params* from, uint x, uint y, intV beside) {
    const intV columns = (intV)(int)x + LANE_INDEX(int);
    const intV across = min(columns - from->fade_left, from->fade_right - 1 - columns);
    const floatV pixels = convert_floatV(min(across, (int)y - from->fade_top)) + 0.5f;
    return select(clamp(pixels / lens_fade, (floatV)0.0f, (floatV)1.0f), (floatV)0.0f, beside > lens_fade);
}

// What was there before, and what the face has found: beside its block, where its results end, nothing.
INLINE floatV passed_over(floatV before, floatV found, floatV fade, intV is_there) {
    const floatV its = select((floatV)NAN, found, is_there);
    const floatV value = select(fma(fade, its - before, before), its, (fade == 1.0f) | isnan(before));
    return select(value, before, (fade == 0.0f) | ((fade < 1.0f) & isnan(its)));
}

// Stores what no other work-item does: others read what is there.
INLINE void store_own(floatV value, uint first, int step, __global float* target) {
    const float_lanes lanes = value;
    for (uint i = first; i < V; ++i)
        target[step * i] = ((const float*)&lanes)[i];
}

KERNEL void from_face(__global const float* planes, __global const float* depth, __global const float* results,
                      __global const float* places, __global float* target, const grid_params grid,
                      const face_params p, const from_face_params from LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end), y = (uint)get_global_id(1) + grid.y_begin;
    if (x >= grid.x_end)
        return;
    const intV beside = pixels_beside(&from, x, y);
    const floatV fade = fade_at(&from, x, y, beside);
    const placesV place =
        places_on_face(places, &p, &from, beside > 0, grid.pixel_x + x, grid.pixel_y + y LENS_VALUES);
    const intV is_sampled = !isnan(place.x); // a ray from aside has no result
    // Pixels of the face, from the middle of its first one.
    const floatV column = clamp(place.x - p.first[0], (floatV)(float)from.first_column, (floatV)(float)from.last_column);
    const floatV row = clamp(place.y - p.first[1], (floatV)(float)from.first_row, (floatV)(float)from.last_row);
    const floatV left = min(floor(column), (floatV)(float)(from.last_column - 1)),
                 top = min(floor(row), (floatV)(float)(from.last_row - 1));
    const floatV s = column - left, t = row - top;
    const intV there = (left >= 0.0f) & (top >= 0.0f); // not where there is no ray
    const intV column_of = select((intV)from.first_column, convert_intV(left), there);
    const intV row_of = select((intV)from.first_row, convert_intV(top), there);
    const intV at_depth = row_of * (int)p.stride + column_of + (int)from.depth_offset;
    const intV at_result =
        (row_of - from.first_row) * (int)from.stride + CHANNELS * (column_of - from.first_column);
    floatV seen[4], values[4][CHANNELS];
    for (int j = 0; j < 2; ++j) {
        pairs_at(depth, at_depth + j * (int)p.stride, &seen[2 * j], &seen[2 * j + 1]);
#if CHANNELS == 1
        pairs_at(results, at_result + j * (int)from.stride, values[2 * j], values[2 * j + 1]);
#else
        const int_lanes first = at_result + j * (int)from.stride;
        for (int k = 0; k < 2; ++k) {
            for (int c = 0; c < CHANNELS; ++c) {
                float lanes[V];
                for (int i = 0; i < V; ++i)
                    lanes[i] = results[((const int*)&first)[i] + CHANNELS * k + c];
                values[2 * j + k][c] = *(const float_lanes*)lanes;
            }
        }
#endif
    }

    const face_planeV plane = planes_in_row(planes, y * p.plane_stride + x, &p);
    const floatV face_x = left + p.first[0], face_y = top + p.first[1], to_x = face_x + s, to_y = face_y + t;
    // The pixel's own inverse depth on the face.
    const floatV own = plane.q * sqrt(fma(fma(to_x, to_x, to_y * to_y), (floatV)(p.pixel * p.pixel), (floatV)1.0f));
    const floatV size = own * p.pixel, steep = fma(plane.right, plane.right, plane.down * plane.down);
    const floatV edge = fma((floatV)from.edge, sqrt(fma(size, size, steep)), from.error * own);
    const floatV inverse = 1.0f / edge;
    floatV whole = 0.0f, sum[CHANNELS], offs[4], bilinear[4];
    for (int c = 0; c < CHANNELS; ++c)
        sum[c] = 0.0f;
    for (int k = 0; k < 4; ++k) {
        const floatV its_x = face_x + (float)(k & 1), its_y = face_y + (float)(k >> 1);
        floatV expected = plane_at(&plane, its_x, its_y);
        const intV bent = fabs(expected - own) > 0.8f * MOST_CHANGE * own;
        if (any_of(bent))
            expected = select(expected, on_face(&p, &plane, its_x, its_y), bent);
        bilinear[k] = (k & 1 ? s : 1.0f - s) * (k >> 1 ? t : 1.0f - t);
        const floatV off = fabs(expected - seen[k]) * inverse;
        offs[k] = select((floatV)INFINITY, off, (off < INFINITY) & (seen[k] > 0.0f) & is_sampled);
        const floatV weight = bilinear[k] * max(1.0f - offs[k], 0.0f);
        whole += weight;
        for (int c = 0; c < CHANNELS; ++c)
            sum[c] += select((floatV)0.0f, weight * values[k][c], weight > 0.0f);
    }
    const intV known = !isnan(plane.q), surface = plane.q > 0.0f;
    const intV lacks = surface & !(whole > KNOWN);
    if (any_of(lacks)) { // the nearest in depth count
        for (int k = 0; k < 4; ++k) {
            const floatV weight = NEAREST * (bilinear[k] + NEAREST) / (1.0f + offs[k]);
            const intV counts = lacks & (offs[k] < INFINITY);
            whole += select((floatV)0.0f, weight, counts);
            for (int c = 0; c < CHANNELS; ++c)
                sum[c] += select((floatV)0.0f, weight * values[k][c], counts);
        }
    }
    __global float* const to = target + grid.target_offset + (size_t)(y - from.y) * grid.target_stride + CHANNELS * (x - from.x);
    const uint first = first_own_lane(x - grid.x_begin);
    const bool fades = any_of((fade < 1.0f) | (beside > 0));
    const intV is_there = (beside == 0) | is_sampled;
#if OUTPUT == 2
    floatV turned[3];
    for (int i = 0; i < 3; ++i)
        turned[i] = fma(sum[0], (floatV)from.unit[i][0], fma(sum[1], (floatV)from.unit[i][1], sum[2] * from.unit[i][2]));
    const floatV length = sqrt(fma(turned[0], turned[0], fma(turned[1], turned[1], turned[2] * turned[2])));
    for (int c = 0; c < 3; ++c)
        turned[c] = select((floatV)NAN, select((floatV)0.0f, turned[c] / length, surface & (length > 0.0f)), known);
    if (fades) {
        for (int c = 0; c < 3; ++c) {
            float lanes[V];
            for (int i = 0; i < V; ++i)
                lanes[i] = to[3 * i + c];
            turned[c] = passed_over(*(const float_lanes*)lanes, turned[c], fade, is_there);
        }
        const floatV its = sqrt(fma(turned[0], turned[0], fma(turned[1], turned[1], turned[2] * turned[2])));
        for (int c = 0; c < 3; ++c)
            turned[c] = select(turned[c], turned[c] / its, (fade > 0.0f) & (fade < 1.0f) & (its > 0.0f));
    }
    for (int c = 0; c < 3; ++c)
        store_own(turned[c], first, 3, to + c);
#else
    const floatV mean = min(max(sum[0] / whole, 0.0f), 1.0f);
    const floatV unknown = OUTPUT == 0 ? 1.0f : 0.0f;
    const floatV one = select((floatV)1.0f, select(unknown, mean, whole > 0.0f), surface);
    const floatV found = select((floatV)NAN, one, known);
    if (fades)
        store_own(passed_over(LOAD(float, to), found, fade, is_there), first, 1, to);
    else
        store_float(found, to);
#endif
}
