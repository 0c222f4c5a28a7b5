// What the near field does to each pixel, from the discs of all near pixels around it:
//   OUTPUT 0   max near CoC  max |c_p| over p with c_p < 0 and |p - x| <= |c_p|/2
//   OUTPUT 1   near alpha    min(1, sum of weight_p over p with |p - x| <= |c_p|/2)           see near_field_weight.cl
//   OUTPUT 2   disocclusion  1 where a near pixel x has a near alpha below 1 (`weights` holds the near alpha),
//                            or where the disc of another pixel x, of diameter |c_x|, holds a near pixel
// A work-item skips every block and tile whose smallest circle cannot reach it. In the others it reads each pixel once
// for all V pixels of its own. Tiles and their pixels are summed in a fixed order: the same bits for every V. The near alpha may
// take several launches, each of which looks into the next rows of blocks and goes on from what the target holds.
// Built for: OUTPUT = 0 1 2

#include "dof_masks/near_field.h"

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

// The lanes' pixels, counted from the first block's corner as tiles and blocks are, and what is known of them so far.
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

// An image that work-items read around their pixels.
typedef struct {
    __global const float* first;
    size_t stride;
} around;

INLINE around image_around(__global const float* image, const place_params* place) {
    return (around){image + place->offset, place->stride};
}

INLINE void look_into_tile(gathered* g, around circle, around weights, uint left, uint top, const near_field_params* p) {
    const uint right = min(left + p->tile, p->left + p->width), bottom = min(top + p->tile, p->top + p->height);
    const floatV twice_x = 2.0f * (vector_from(g->x) - 0.5f);
#if OUTPUT == 1
    floatV of_tile =
        (floatV)0.0f; // sums of sums: the rounding of a disc's 50000 weights, added one by one, would be seen
#endif
    for (uint y = max(top, p->top); y < bottom; ++y) {
        const size_t row = y - p->top;
        const floatV down = (floatV)(2.0f * p->vertical * ((float)y - (float)g->y));
#if OUTPUT == 1
        floatV of_row = (floatV)0.0f;
        __global const float* given_row = weights.first + (row - p->first_row) * weights.stride;
#endif
        __global const float* circle_row = circle.first + row * circle.stride;
        for (uint x = max(left, p->left); x < right; ++x) {
            const float c = circle_row[x - p->left];
            const floatV aside = twice_x - 2.0f * (float)x;
#if OUTPUT == 0
            if (-c > g->least)
                g->found = select(g->found, max(g->found, (floatV)-c), reaches((floatV)c, aside, down));
#elif OUTPUT == 1
            const float given = given_row[x - p->left];
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

#if OUTPUT != 0
// The lanes that no other work-item has, of what lies there. Of the others a neighbour may be writing its own.
INLINE floatV load_own(__global const float* source, uint first_lane) {
    if (first_lane == 0)
        return LOAD(float, source);
    float lanes[V];
    for (uint i = 0; i < V; ++i)
        lanes[i] = i < first_lane ? 0.0f : source[i];
    return *(const float_lanes*)lanes;
}
#endif

INLINE void store_own(floatV value, __global float* target, uint first_lane) {
    if (first_lane == 0) {
        *(__global float_lanes*)target = value;
        return;
    }
    float lanes[V];
    *(float_lanes*)lanes = value;
    for (uint i = first_lane; i < V; ++i)
        target[i] = lanes[i];
}

// `weights`: of the rows that are looked into; for disocclusion the near alpha of all pixels, which may be what the target holds.
KERNEL void near_field(__global const float* circle, const place_params circle_place, __global const float* weights,
                         const place_params weights_place, __global const float* tile_min_coc,
                         __global const float* block_least, __global float* target, const place_params target_place,
                         const near_field_params p) {
    const uint x = first_column(0, p.width);
    const uint y = get_global_id(1);
    if (x >= p.width || y >= p.height)
        return;

    const floatV none = (floatV)0.0f;
    const uint own_lane = first_own_lane(x);
    const around circles = image_around(circle, &circle_place), given = image_around(weights, &weights_place);
    gathered g = {.x = p.left + x, .y = p.top + y, .own = none, .own_most = 0.0f, .found = none, .least = 0.0f};
    target += element_at(&target_place, x, y);
#if OUTPUT != 1
    const floatV c = LOAD(float, circle + element_at(&circle_place, x, y));
    const intV known = c == c;
#endif
#if OUTPUT == 0
    g.found = select(none, max(-c, none), known);
    g.least = least_lane(g.found);
    look_into_tile(&g, circles, given, g.x / p.tile * p.tile, g.y / p.tile * p.tile, &p); // the rest is then mostly ruled out
#elif OUTPUT == 1
    if (p.first_row > 0)
        g.found = load_own(target, own_lane);
#else
    const intV is_near = c < -p.sharp;
    g.own = select(fabs(c), none, is_near | !known);
    g.own_most = -least_lane(-g.own);
#endif
    const uint across = near_block * p.tile;
    for (uint block_row = (p.top + p.first_row) / across; block_row * across < p.top + p.last_row; ++block_row) {
        for (uint block = 0; block < p.block_columns; ++block) {
            if (!may_matter(&g, block_least[(size_t)block_row * p.block_stride + block], block * across,
                            block_row * across, across, &p))
                continue;
            const uint last_row = min((block_row + 1) * near_block, p.rows), last = min((block + 1) * near_block, p.columns);
            for (uint row = block_row * near_block; row < last_row; ++row) {
                for (uint tile = block * near_block; tile < last; ++tile) {
                    if (may_matter(&g, tile_min_coc[(size_t)row * p.tile_stride + tile], tile * p.tile, row * p.tile,
                                   p.tile, &p))
                        look_into_tile(&g, circles, given, tile * p.tile, row * p.tile, &p);
                }
            }
        }
    }
#if OUTPUT == 1
    g.found = min(g.found, (floatV)1.0f); // after some rows already: what is added is no less than 0
#elif OUTPUT == 2
    const floatV alpha = load_own(weights + element_at(&weights_place, x, y), own_lane);
    g.found = select(g.found, select(none, (floatV)1.0f, alpha < p.shows), is_near);
    g.found = select(none, g.found, known);
#endif
    store_own(g.found, target, own_lane);
}
