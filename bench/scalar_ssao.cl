// Ambient occlusion with its loop over samples written per pixel, as engines write it: what `ssao` is compared with.
// The samples of `balanced` and their arithmetic are those of kernels/ssao.cl, where the equations stand, but for what is
// faster here; what is not are its vector width, its planes of one sampling pattern each and its table of places: one work-item a
// pixel, neighbours in memory look into different directions, and places are computed on the way. Visibility is not
// filtered. For a centred perspective of square pixels in a closed scene.

#define INLINE static inline __attribute__((always_inline)) // a tenth faster than without
#define SECTORS 31.0f
#define STEEP 0.5f
#define NOTHING -1e30f

// Of a sampling pattern and slice: direction on the screen, rounding of sectors, distances as shares of the sphere's.
typedef struct {
    float turn_x, turn_y, rounding, reserved;
    float shares[2][STEPS + 1];
} pattern_slice;

// A side of a slice: cot t = scale (q - q_c) / s + offset, s pixels away.
typedef struct {
    float turn_x, turn_y;
    float q, slack, across, tangent;
    float scale, offset;
    float middle, middle_step;
    float reach, reach_step, cut;
    float per_depth, nearest;
    float rises, falls;
    float first;
    float lowest, full;
    float sectors_square, sectors_nu, sectors_offset;
} half_slice;

INLINE float slope_of(float before2, float before1, float centre, float after1, float after2) {
    const float before = fabs(2 * before1 - before2 - centre), after = fabs(2 * after1 - after2 - centre);
    if (max(before, after) <= 4 * min(before, after) + 1e-6f)
        return 0.5f * (after1 - before1);
    return before < after ? centre - before1 : after1 - centre;
}

// Inverse depth 1/z, affine in what is stored; far beyond everything outside the image.
INLINE float inverse_depth_at(__global const float* row, int x, int end, float z, float w) {
    return x >= 0 && x < end ? fma(z, row[x], w) : 1e9f;
}

// Inverse depth, where the surface's solid ends, and the slopes of the tangent plane.
__kernel void scalar_surfaces(__global const float* stored, __global float4* surfaces, const int width,
                              const int height, const int stride, const float z, const float w, const float focal,
                              const float thickness) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width)
        return;
    __global const float* row = stored + (size_t)y * stride;
    const float q = fma(z, row[x], w);
    const float right = slope_of(inverse_depth_at(row, x - 2, width, z, w), inverse_depth_at(row, x - 1, width, z, w), q,
                                 inverse_depth_at(row, x + 1, width, z, w), inverse_depth_at(row, x + 2, width, z, w));
    float rows[5];
    for (int i = -2; i <= 2; ++i)
        rows[i + 2] = y + i >= 0 && y + i < height ? fma(z, row[x + i * stride], w) : 1e9f;
    const float down = slope_of(rows[0], rows[1], q, rows[3], rows[4]);
    const float dx = (x + 0.5f - 0.5f * width) / focal, dy = (0.5f * height - y - 0.5f) / focal;
    const float back = q / fma(q * thickness, rsqrt(1 + dx * dx + dy * dy), 1.0f);
    surfaces[y * width + x] = (float4)(q, back, right, down);
}

// asin c + c sqrt(1 - c^2), the library's approximation.
INLINE float lens(float c) {
    const float c2 = c * c;
    const float h = fma(c2, fma(c2, -0.211485824f, 0.210784609f), -0.439477174f);
    return c * fma(c2, h, 2.01097472f);
}

INLINE int sectors_to(float cotangent, const half_slice* side) {
    const float c = max(cotangent * rsqrt(fma(cotangent, cotangent, 1.0f)), side->lowest);
    return (int)fma(c * c, side->sectors_square, fma(lens(c), side->sectors_nu, side->sectors_offset));
}

// A pixel that the slice passes: how far along it, the surface there less q_c, and how it goes on.
typedef struct {
    float along;
    float front, to_line, tilt, height, back;
} column;

INLINE column column_at(const half_slice* side, __global const float4* surfaces, float s, int x, int y, int width,
                        int height) {
    const float dx = rint(s * side->turn_x), dy = rint(s * side->turn_y);
    const int there_x = x + (int)dx, there_y = y + (int)dy;
    const float aside = fma(dx, side->turn_y, -dy * side->turn_x);
    column c;
    c.along = fma(dx, side->turn_x, dy * side->turn_y);
    if (there_x < 0 || there_y < 0 || there_x >= width || there_y >= height) {
        c.front = c.back = c.height = NOTHING;
        c.tilt = c.to_line = 0;
        return c;
    }
    const float4 there = surfaces[there_y * width + there_x];
    c.tilt = fma(side->turn_x, there.z, side->turn_y * there.w);
    c.to_line = fma(fma(side->turn_x, there.w, -side->turn_y * there.z), aside, -side->q);
    c.front = there.x + c.to_line;
    c.height = fma(side->across, aside, there.x - side->q) - side->tangent * c.along;
    c.back = there.y;
    return c;
}

// (q - q_c) / s where a column ends on the side of its neighbour: at their outward edge, or `end` pixels away.
INLINE float end_of(const half_slice* side, const column* seen, const column* near, const column* far, float end) {
    const float gap = far->along - near->along;
    const float over = fma(near->tilt, gap, near->front) - far->front;
    const float under = fma(-far->tilt, gap, far->front) - near->front;
    if (over > 0 && under > 0) {
        const float sum = over + under;
        return fma(near->tilt * gap, under, near->front * sum) / fma(gap, under, near->along * sum);
    }
    const float tilt = max(min(seen->tilt, side->rises), side->falls);
    return fma(tilt, end - seen->along, seen->front) / end;
}

// The sectors that a column blocks between the ends of its front, inside the sphere.
INLINE int sectors_of(const half_slice* side, const column* seen, float inner, float outer) {
    if (!(max(inner, outer) > side->first))
        return 0;
    const float s = seen->along, inverse = 1 / s;
    const float reach = fma(-s, side->reach_step, side->reach);
    const float square = max(fma(-s * s, side->cut, reach * reach), 0.0f);
    const float half_length = sqrt(square) * side->per_depth;
    const float middle = fma(-s, side->middle_step, side->middle);
    const float lowest = (middle - half_length) * inverse;
    const float highest = max(middle + half_length, side->nearest) * inverse;
    const float behind = (seen->back + seen->to_line) * inverse;
    const float top = max(min(max(inner, outer), highest), lowest);
    const float bottom = max(min(min(min(inner, outer), behind), highest), lowest);
    const int from = max(sectors_to(fma(side->scale, bottom, side->offset), side), 0);
    const int to = min(max(sectors_to(fma(side->scale, top, side->offset), side), from), (int)SECTORS);
    return (1 << to) - (1 << from);
}

// Sectors blocked by the samples of one side. Most columns can block none, whose ends are not looked for.
INLINE int blocked_by(const half_slice* side, __global const float4* surfaces, __global const float* shares, int x,
                      int y, int width, int height) {
    const float falls = sqrt(max(side->cut, 0.0f)) + side->reach_step;
    const float limit = (float)max(width, height);
    const float extent = falls > 0 && side->cut > 0 ? min(side->reach / falls, limit) : limit;
    const int count = extent > 1 ? min(STEPS, (int)ceil(extent)) : 0;
    int found = 0;
    float s = max(1.0f, extent * shares[0]), inner = 0.5f * s;
    column last = column_at(side, surfaces, 0, x, y, width, height);
    column seen = column_at(side, surfaces, s, x, y, width, height);
    for (int i = 0; i < count && seen.front > NOTHING; ++i) {
        const float beyond = max(i + 2.0f, extent * shares[i + 1]), outer = 0.5f * (s + beyond);
        const column next = column_at(side, surfaces, beyond, x, y, width, height);
        const float low = i > 0 ? last.along : inner;
        const float before = fma(seen.tilt, low - seen.along, seen.front) - side->first * low;
        const float after = fma(seen.tilt, next.along - seen.along, seen.front) - side->first * next.along;
        if (max(before, after) > 0 && seen.height > -side->slack)
            found |= sectors_of(side, &seen, end_of(side, &seen, &last, &seen, inner),
                                end_of(side, &seen, &seen, &next, outer));
        last = seen, seen = next, s = beyond, inner = outer;
    }
    return found;
}

__kernel void scalar_ssao(__global const float4* surfaces, __global const pattern_slice* patterns,
                          __global float* target, const int width, const int height, const int stride,
                          const float focal, const float radius, const float error) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width)
        return;
    const float4 here = surfaces[y * width + x];
    const float q = here.x, right = here.z, down = here.w;
    const float pixel = 1 / focal;
    const float dx = (x + 0.5f - 0.5f * width) * pixel, dy = (0.5f * height - y - 0.5f) * pixel;
    const float length_square = 1 + dx * dx + dy * dy, inverse_length = rsqrt(length_square);
    const float length = length_square * inverse_length, distance = length / q;
    const float towards_x = -inverse_length * dx * pixel, towards_y = inverse_length * dy * pixel;
    const float steepest = q * q * STEEP * radius * inverse_length;
    const float beyond = distance * distance - radius * radius, least = 1e-5f * radius * radius;
    const float outside = fabs(beyond) < least ? least : beyond;

    half_slice side;
    side.q = q + 2 * error;
    side.slack = 4 * error;
    side.per_depth = 1 / outside;
    side.nearest = outside < 0 ? 1e30f : -1e30f;
    side.middle = q * side.per_depth * (radius * radius);
    side.reach = radius * length;

    float blocked = 0, whole = 0;
    for (int k = 0; k < SLICES; ++k) {
        __global const pattern_slice* slice = patterns + ((y & 3) * 4 + (x & 3)) * SLICES + k;
        for (int opposite = 0; opposite < 2; ++opposite) {
            side.turn_x = opposite ? -slice->turn_x : slice->turn_x;
            side.turn_y = opposite ? -slice->turn_y : slice->turn_y;
            const float toward = side.turn_x * towards_x + side.turn_y * towards_y;
            const float across_square = pixel * pixel - toward * toward, inverse_across = rsqrt(across_square);
            const float slope_along = side.turn_x * right + side.turn_y * down;
            side.rises = max(slope_along, steepest);
            side.falls = min(slope_along, -steepest);
            side.across = side.turn_x * down - side.turn_y * right;
            side.scale = distance * inverse_across;
            side.cut = outside * across_square;
            side.middle_step = distance * side.per_depth * toward;
            side.reach_step = radius * toward;
            const float offset = toward * inverse_across;
            const float tangent = side.scale * slope_along + offset;
            side.tangent = slope_along;
            side.offset = offset - side.scale * 2 * error;
            side.lowest = tangent * rsqrt(tangent * tangent + 1);
            const float nu = -tangent;
            const float full = 1 - side.lowest * side.lowest + nu * (M_PI_2_F - lens(side.lowest));
            side.full = max(full, 1e-6f);
            side.sectors_square = SECTORS / side.full;
            side.sectors_nu = side.sectors_square * nu;
            side.sectors_offset = SECTORS + slice->rounding - side.sectors_square * (nu * M_PI_2_F + 1);

            const float above = sqrt(side.full * (1 - slice->rounding) / SECTORS * rsqrt(nu * nu + 1));
            const float sky = 1 - tangent * above;
            side.first = sky > 0 ? ((tangent + above) / sky - side.offset) / side.scale : INFINITY;

            const float weighted = inverse_across * inverse_across * side.full;
            const int found = blocked_by(&side, surfaces, slice->shares[opposite], x, y, width, height);
            whole += weighted;
            blocked += weighted * popcount(found) * (1 / SECTORS);
        }
    }
    target[(size_t)y * stride + x] = clamp(1 - blocked / whole, 0.0f, 1.0f);
}
