// Obscurance: every place looked at adds what its direction and distance are worth, and nothing hides anything else.
//   blocked = INTENSITY * mean of max(0, n.v / |v|) f(|v| / radius)
// FALLOFF 0: f(d) = 1 - d^2, as HBAO+ (Bavoil, Sainz 2008 and after); 1: f(d) = (1 - d^2)^3 / d, "Scalable ambient obscurance"
// (McGuire, Mara, Luebke 2012). The mean is over the slice's length on the screen. Places, planes of one sampling pattern each,
// slopes and the slices' weights are those of kernels/ssao.cl, whose text stands before this; so are the tangent plane and the
// bound of the depth's error. As in the papers what rises by less than a constant counts for nothing: slopes have 8 bits.

#define BIAS 0.01f // of the cosine

#ifndef FALLOFF
#error "FALLOFF is not defined: 0 for HBAO+, 1 for scalable ambient obscurance"
#endif

// Cosine between the normal and the view ray.
INLINE floatV facing_of(const pixelV* c, const occlusion_params* p) {
    floatV across[3], down[3], n[3];
    for (int i = 0; i < 3; ++i) {
        const floatV unit = PERSPECTIVE ? c->direction[i] / c->q : c->direction[i];
        across[i] = fma(-unit, c->right, (floatV)p->step[i][0]);
        down[i] = fma(-unit, c->down, (floatV)p->step[i][1]);
    }
    floatV square = 0.0f, along = 0.0f;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = across[j] * down[k] - across[k] * down[j];
        square = fma(n[i], n[i], square);
        along = fma(n[i], c->direction[i], along);
    }
    return fabs(along) * c->inverse_length * inverse_root(square);
}

__kernel void obscurance(__global const float* fronts, __global const float* slopes, __global const float* taps,
                         __global const float* turns, __global const uint* counts, __global const float* intensity,
                         __global float* sums, const split_params split, const occlusion_params p) {
    const itemV item = item_of(&split);
    const int pattern = item.pattern, column = item.column, row = item.row;
    if (column >= (int)split.columns)
        return;

    const uint here = in_plane(&split, pattern, column, row), all = 16 * split.plane;
    const pixelV c = pixel_at(fronts, slopes, &split, &p, here, pattern, column, row);
    const floatV facing = facing_of(&c, &p), per_radius = (floatV)(1.0f / p.radius);
    floatV blocked = 0.0f, whole = 0.0f;
    for (uint k = 0; k < p.slices; ++k) {
        const sliceV slice = slice_at(&c, &p, turns + 4 * (pattern * p.slices + k));
        const floatV weight = slice.inverse_across * slice.inverse_across;
        const floatV width = slice.across_square * slice.inverse_across * per_radius;
        for (int back = 0; back < 2; ++back) {
            const float sign = back ? -1.0f : 1.0f;
            const sideV side = side_at(&c, &slice, sign, p.slope_errors);
            const intV levels = min(((as_intV(side.extent * side.extent) + 0x7fffff) >> 23) - 127, (intV)(int)p.levels);
            intV left_over = select((intV)0, levels, c.surface);
            floatV share = 0.0f;
            for (int level = greatest(left_over); level > 0; level = greatest(left_over)) {
                const intV active = left_over == level;
                const int count = (int)counts[level];
                const uint table = ((uint)pattern * p.slices + k) * 2 + (uint)back;
                __global const tap_params* const tap = (__global const tap_params*)taps +
                                                       counts[2 * p.levels + level] + ((uint)count + 2) * table + 1;
                const placeV place = place_at(here, column, row, (int)counts[p.levels + level], &split);
                floatV sum = 0.0f;
                float length = 0;
                for (int i = 0; i < count; ++i) {
                    const float stretch = tap[i].high - tap[i].low;
                    const floatV front = LOAD(float, fronts + at_tap(&place, &split, tap + i));
                    const floatV q = fma(side.across, (floatV)tap[i].aside, front);
                    const floatV cotangent = fma(side.scale, (q - side.q) * tap[i].inverse_distance, side.offset);
                    const floatV square = fma(cotangent, cotangent, (floatV)1.0f);
                    const floatV cosine =
                        max(fma((cotangent + side.nu) * facing, rough_inverse_root(square), (floatV)-BIAS), 0.0f);
#if PERSPECTIVE
                    const floatV away = width * tap[i].distance * rough_inverse(q);
#else
                    const floatV away = width * tap[i].distance;
#endif
                    const floatV distance_square = away * away * square;
                    const floatV rest = max((floatV)1.0f - distance_square, 0.0f);
#if FALLOFF == 0
                    const floatV worth = cosine * rest;
#else
                    const floatV worth = cosine * rest * rest * rest * rough_inverse_root(max(distance_square, 1e-4f));
#endif
                    sum = fma(select((floatV)0.0f, worth, front > NOTHING), (floatV)stretch, sum);
                    length += stretch;
                }
                share = select(share, sum / length, active);
                left_over = select(left_over, (intV)0, active);
            }
            whole += weight;
            blocked = fma(weight * share, (floatV)intensity[0], blocked);
        }
    }
    STORE(sums + here, select((floatV)0.0f, blocked, c.surface));
    STORE(sums + all + here, select((floatV)0.0f, whole, c.surface));
}
