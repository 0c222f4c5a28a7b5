// What the near field does to each pixel, from the discs of all near pixels around it:
//   OUTPUT 0   max near CoC  max |c_p| over p with c_p < 0 and |p - x| <= |c_p|/2
//   OUTPUT 1   near alpha    min(1, sum of weight_p over p with |p - x| <= |c_p|/2)           see near_field_weight.cl
//   OUTPUT 2   disocclusion  1 where a near pixel x has a near alpha below 1 (`weights` holds the near alpha),
//                            or where the disc of another pixel x, of diameter |c_x|, holds a near pixel
// A work-item skips every block and tile whose smallest circle cannot reach it. In the others it reads each pixel once
// for all V pixels of its own. Tiles and their pixels are summed in a fixed order: the same bits for every V.
// Built for: OUTPUT = 0 1 2

#include "near_field.h"

#if !defined(OUTPUT) || OUTPUT < 0 || OUTPUT > 2
#error "OUTPUT is not defined: 0 max near CoC, 1 near alpha, 2 disocclusion"
#endif

// Number of pixels between two ranges of columns or rows.
INLINE float gap(uint first, uint last, uint other_first, uint other_last) {
    return other_first > last ? (float)(other_first - last) : first > other_last ? (float)(first - other_last) : 0.0f;
}

#if OUTPUT != 1
INLINE float least_lane(floatV v) {
    float lanes[V];
    *(float_lanes*)lanes = v;
    float result = lanes[0];
    for (int i = 1; i < V; ++i)
        result = min(result, lanes[i]);
    return result;
}
#endif

// The lanes' pixels, and what is known of them so far.
typedef struct {
    uint x, y;
    floatV own;     // disocclusion: diameters of the pixels' own discs
    float own_most; // the largest of these
    floatV found;   // max near CoC: the largest; near alpha: the sum; disocclusion: 1 or 0
    float least;    // of `found` of all lanes
} gathered;

// May any pixel of a square whose least circle is known change the result?
INLINE int may_matter(const gathered* g, float least, uint left, uint top, uint across, const near_field_params* p) {
    const float aside = 2.0f * gap(g->x, g->x + (V - 1), left, left + (across - 1));
    const float down = 2.0f * p->vertical * gap(g->y, g->y, top, top + (across - 1));
#if OUTPUT == 0
    const float size = -least > g->least ? -least : 0.0f;
#elif OUTPUT == 1
    const float size = least < 0.0f ? -least : 0.0f;
#else
    const float size = least < -p->sharp ? g->own_most : 0.0f;
#endif
    return size > 0.0f && fma(aside, aside, down * down) <= size * size;
}

INLINE void look_into_tile(gathered* g, __global const float* circle, __global const float* weights, uint left, uint top,
                           const near_field_params* p) {
    const uint right = min(left + p->tile, p->width), bottom = min(top + p->tile, p->height);
    const floatV twice_x = 2.0f * (vector_from(g->x) - 0.5f);
#if OUTPUT == 1
    floatV of_tile =
        (floatV)0.0f; // sums of sums: the rounding of a disc's 50000 weights, added one by one, would be seen
#endif
    for (uint y = top; y < bottom; ++y) {
        const floatV down = (floatV)(2.0f * p->vertical * ((float)y - (float)g->y));
#if OUTPUT == 1
        floatV of_row = (floatV)0.0f;
#endif
        for (uint x = left; x < right; ++x) {
            const size_t at = (size_t)y * p->stride + x;
            const float c = circle[at];
            const floatV aside = twice_x - 2.0f * (float)x;
#if OUTPUT == 0
            if (-c > g->least)
                g->found = select(g->found, max(g->found, (floatV)-c), reaches((floatV)c, aside, down));
#elif OUTPUT == 1
            const float given = weights[at];
            if (given > 0.0f)
                of_row += select((floatV)0.0f, (floatV)given, reaches((floatV)c, aside, down));
#else
            if (c < -p->sharp)
                g->found = select(g->found, (floatV)1.0f, reaches(g->own, aside, down));
#endif
        }
#if OUTPUT == 1
        of_tile += of_row;
#endif
    }
#if OUTPUT == 0
    g->least = least_lane(g->found);
#elif OUTPUT == 1
    g->found += of_tile;
#endif
}

KERNEL void near_field(__global const float* circle, __global const float* weights, __global const float* tile_min_coc,
                         __global const float* block_least, __global float* target, const near_field_params p) {
    const uint x = first_column(0, p.width);
    const uint y = get_global_id(1);
    if (x >= p.width || y >= p.height)
        return;

    const size_t at = (size_t)y * p.stride + x;
    const floatV none = (floatV)0.0f;
    gathered g = {.x = x, .y = y, .own = none, .own_most = 0.0f, .found = none, .least = 0.0f};
#if OUTPUT != 1
    const floatV c = LOAD(float, circle + at);
    const intV known = c == c;
#endif
#if OUTPUT == 0
    g.found = select(none, max(-c, none), known);
    g.least = least_lane(g.found);
    look_into_tile(&g, circle, weights, x / p.tile * p.tile, y / p.tile * p.tile,
                   &p); // the rest is then mostly ruled out
#elif OUTPUT == 2
    const intV is_near = c < -p.sharp;
    g.own = select(fabs(c), none, is_near | !known);
    g.own_most = -least_lane(-g.own);
#endif
    for (uint block_row = 0; block_row < p.block_rows; ++block_row) {
        for (uint block = 0; block < p.block_columns; ++block) {
            const uint across = near_block * p.tile;
            if (!may_matter(&g, block_least[(size_t)block_row * p.block_stride + block], block * across,
                            block_row * across, across, &p))
                continue;
            const uint last_row = min((block_row + 1) * near_block, p.rows), last = min((block + 1) * near_block, p.columns);
            for (uint row = block_row * near_block; row < last_row; ++row) {
                for (uint tile = block * near_block; tile < last; ++tile) {
                    if (may_matter(&g, tile_min_coc[(size_t)row * p.tile_stride + tile], tile * p.tile, row * p.tile,
                                   p.tile, &p))
                        look_into_tile(&g, circle, weights, tile * p.tile, row * p.tile, &p);
                }
            }
        }
    }
#if OUTPUT == 1
    g.found = min(g.found, (floatV)1.0f);
#elif OUTPUT == 2
    g.found = select(g.found, select(none, (floatV)1.0f, LOAD(float, weights + at) < p.shows), is_near);
    g.found = select(none, g.found, known);
#endif
    *(__global float_lanes*)(target + at) = g.found;
}
