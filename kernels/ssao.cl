// Ambient occlusion from planar depth, V pixels of one sampling pattern per work-item.
//   visibility = 1 - sum_slices w B / sum_slices w G,   w = dphi(view ray) / dphi(screen)
// A slice is the plane through the view ray and a direction on the screen; B of its cosine-weighted measure
//   G(t) = 1/2 [sin^2 t + nu (t - sin t cos t)],  nu = n.T / n.V,  t from the view ray to the tangent plane
// is blocked by what neighbouring pixels show: columns along their own rays, from the surface to `back`, cut off at the
// ball of the radius. In planar depth the cotangent of t is affine in (q - q_c) / s, s pixels away: no square root but
// that of the ball, no angle, and the tangent plane is exact under every camera. With a finite thickness a side of a
// slice is 31 sectors of the same measure, one bit each; without one the horizon itself is enough.
// Jimenez et al. 2016 (slices, the measure); Therrien et al. 2023 (bits); Mara et al. 2013 (split planes). Slices are
// weighted to be uniform around the view ray, not on the screen.

#include "split.h"

#ifndef PERSPECTIVE
#error "PERSPECTIVE is not defined: 1 where rays meet in an eye, 0 where they are parallel"
#endif

#define SECTORS 31.0f

// 1 / sqrt(a) to 1.8e-3: one step of Newton.
INLINE floatV rough_inverse_root(floatV a) {
    const floatV guess = as_floatV(0x5f375a86 - (as_intV(a) >> 1));
    return guess * fma(-0.5f * a * guess, guess, (floatV)1.5f);
}

// asin c + c sqrt(1 - c^2) to 5.2e-4.
INLINE floatV lens(floatV c) {
    const floatV c2 = c * c;
    floatV h = fma(c2, (floatV)-0.281868368f, (floatV)0.484938663f);
    h = fma(c2, h, (floatV)-0.369869089f);
    h = fma(c2, h, (floatV)-0.256940177f);
    return c * fma(c2, h, (floatV)1.99504886f);
}

// Twice the measure from the view ray to the angle of cosine c.
INLINE floatV measure(floatV c, floatV nu) {
    return fma(-c, c, (floatV)1.0f) + nu * ((float)M_PI_2_F - lens(c));
}

INLINE int greatest(intV a) {
#if V == 1
    return a;
#else
    int lanes[V];
    *(intV*)lanes = a;
    int most = lanes[0];
    for (int i = 1; i < V; ++i)
        most = max(most, lanes[i]);
    return most;
#endif
}

// One side of a slice: cot t = scale (q - q_c) / s + offset, see the head.
typedef struct {
    floatV q;                      // of the pixel, moved towards the eye by what its depth may be off
    floatV across;                 // slope of q across the slice
    floatV scale, offset;          // of the cotangent
    floatV middle, middle_step;    // where the ball's centre lies on the ray s pixels away, less q
    floatV reach, reach_step, cut; // its half length there is root((reach - s reach_step)^2 - s^2 cut) / per_depth
    floatV per_depth;
    floatV nearest;                // the ball's near end is at least here: the eye may be inside
    floatV lowest;                 // cosine of the tangent plane
    floatV sectors_square, sectors_nu, sectors_offset;
} sideV;

typedef struct {
    floatV low, high; // q less q_c between which a column counts
} ballV;

INLINE ballV ball_at(const sideV* side, float s) {
    const floatV reach = fma((floatV)-s, side->reach_step, side->reach);
    const floatV square = max(fma((floatV)(-s * s), side->cut, reach * reach), 0.0f);
    const floatV half_length = square * rough_inverse_root(square);
    const floatV middle = fma((floatV)-s, side->middle_step, side->middle);
    return (ballV){fma(-half_length, side->per_depth, middle),
                   max(fma(half_length, side->per_depth, middle), side->nearest)};
}

INLINE intV sector(floatV cotangent, const sideV* side, float rounding) {
    const floatV c = max(cotangent * rough_inverse_root(fma(cotangent, cotangent, (floatV)1.0f)), side->lowest);
    const floatV turned = fma(c * c, side->sectors_square, fma(lens(c), side->sectors_nu, side->sectors_offset));
    return convert_intV(clamp(turned, 0.0f, SECTORS) + rounding);
}

__kernel void ssao(__global const float* fronts, __global const float* backs, __global const float* slopes,
                   __global const float* taps, __global const float* turns, __global const uint* counts,
                   __global float* sums, const split_params split, const occlusion_params p) {
    const int column = (int)get_global_id(0) * V;
    const int pattern = (int)get_global_id(1) / (int)split.rows;
    const int row = (int)get_global_id(1) % (int)split.rows;
    if (column >= (int)split.columns)
        return;

    const uint here = in_plane(&split, pattern, column, row), all = 16 * split.plane;
    const floatV front = LOAD(float, fronts + here);
    const intV surface = front > NOTHING;
    const floatV q = select((floatV)(PERSPECTIVE ? 1.0f : 0.0f), front, surface);
    const floatV right = LOAD(float, slopes + here), down = LOAD(float, slopes + all + here);

    // The pixel's ray, and what one pixel's step adds, along it and across.
    const float y = (float)(4 * row + pattern / 4 + (int)(split.pixel_y & ~3u)) + 0.5f;
    const floatV x =
        fma((floatV)4.0f, convert_floatV((intV)column + LANE_INDEX(int)), (float)(pattern % 4 + (int)(split.pixel_x & ~3u)) + 0.5f);
    floatV direction[3];
    for (int i = 0; i < 3; ++i)
        direction[i] = fma((floatV)p.direction[i][0], x, fma(p.direction[i][1], y, p.direction[i][2]));
    const floatV length_square = fma(direction[0], direction[0], fma(direction[1], direction[1], direction[2] * direction[2]));
    const floatV inverse_length = 1.0f / sqrt(length_square), length = length_square * inverse_length;
    floatV along[2]; // towards the eye
    for (int k = 0; k < 2; ++k)
        along[k] = -inverse_length * fma(direction[0], p.step[0][k], fma(direction[1], p.step[1][k], direction[2] * p.step[2][k]));
    const float step_xx = p.step[0][0] * p.step[0][0] + p.step[1][0] * p.step[1][0] + p.step[2][0] * p.step[2][0];
    const float step_yy = p.step[0][1] * p.step[0][1] + p.step[1][1] * p.step[1][1] + p.step[2][1] * p.step[2][1];
    const float step_xy = p.step[0][0] * p.step[0][1] + p.step[1][0] * p.step[1][1] + p.step[2][0] * p.step[2][1];

    const floatV size = fabs(q);
    const floatV error = fma(size, fma(size, (floatV)p.error_quadratic, (floatV)p.error_linear), (floatV)p.error_constant);
#if PERSPECTIVE
    const floatV distance = length / q;
    const floatV beyond = fma(distance, distance, (floatV)(-p.radius * p.radius));
    const floatV safe = select(beyond, (floatV)(1e-5f * p.radius * p.radius), fabs(beyond) < 1e-5f * p.radius * p.radius);
    const floatV per_depth = 1.0f / safe;
    const floatV depth_scale = distance;
    const floatV nearest = select((floatV)-1e30f, (floatV)1e30f, safe < 0.0f);
#else
    const floatV per_depth = inverse_length;
    const floatV depth_scale = length;
    const floatV nearest = (floatV)-1e30f;
#endif

    floatV blocked = 0.0f, whole = 0.0f;
    for (uint k = 0; k < p.slices; ++k) {
        const float turn_x = turns[2 * (pattern * p.slices + k)], turn_y = turns[2 * (pattern * p.slices + k) + 1];
        const floatV step_along = fma((floatV)turn_x, along[0], turn_y * along[1]);
        const float step_square = turn_x * turn_x * step_xx + turn_y * turn_y * step_yy + 2 * turn_x * turn_y * step_xy;
        const floatV across_square = fma(-step_along, step_along, (floatV)step_square);
        const floatV inverse_across = 1.0f / sqrt(across_square);
        const floatV weight = inverse_across * inverse_across;
        const floatV slope_along = fma((floatV)turn_x, right, turn_y * down);

        sideV side;
        side.q = q + 2.0f * error;
        side.across = fma((floatV)-turn_y, right, turn_x * down);
        side.scale = depth_scale * inverse_across;
        side.per_depth = per_depth;
        side.nearest = nearest;
#if PERSPECTIVE
        side.cut = safe * across_square;
        side.middle = q * per_depth * (p.radius * p.radius);
        side.reach = p.radius * length;
#else
        side.cut = across_square;
        side.middle = 0.0f;
        side.reach = p.radius;
#endif
        for (int sign = 1; sign >= -1; sign -= 2) {
            const floatV toward = (float)sign * step_along;
            side.offset = toward * inverse_across;
#if PERSPECTIVE
            side.middle_step = distance * per_depth * toward;
            side.reach_step = p.radius * toward;
#else
            side.middle_step = toward * inverse_length;
            side.reach_step = 0.0f;
#endif
            const floatV tangent = fma(side.scale, (float)sign * slope_along, side.offset);
            side.lowest = tangent / sqrt(fma(tangent, tangent, (floatV)1.0f));
            const floatV nu = -tangent;
            const floatV full = max(measure(side.lowest, nu), 1e-6f);
            const floatV per_sector = SECTORS / full;
            side.sectors_square = per_sector;
            side.sectors_nu = per_sector * nu;
            side.sectors_offset = SECTORS - per_sector * fma(nu, (floatV)M_PI_2_F, (floatV)1.0f);

            // How far the ball reaches on the screen: where its half length ends.
            const floatV falls = sqrt(max(side.cut, 0.0f)) + side.reach_step;
            const floatV far_away = select((floatV)1e9f, side.reach / falls, (falls > 0.0f) & (side.cut > 0.0f));
            const floatV extent = min(far_away, 1e9f);
            const intV level = select((intV)0, min(((as_intV(extent * extent) + 0x7fffff) >> 23) - 127, (intV)(int)p.levels), surface);

            intV found = 0;
            intV left_over = level;
            for (int now = greatest(left_over); now > 0; now = greatest(left_over)) {
                intV covered = 0;
                const uint table = (((uint)(now - 1) * 16 + (uint)pattern) * p.slices + k) * 2 + (sign < 0 ? 1 : 0);
                __global const float* tap = taps + 8 * p.steps * table;
                const uint count = counts[now];
                for (uint i = 0; i < count; ++i, tap += 8) {
                    const int place = as_int(tap[0]), offset = as_int(tap[1]);
                    const float s = tap[2], aside = tap[3];
                    const int tap_column = clamp(column + ((offset << 16) >> 16), -MARGIN, (int)split.columns);
                    const int tap_row = clamp(row + (offset >> 16), -1, (int)split.rows);
                    const uint at = in_plane(&split, place, tap_column, tap_row);
                    const floatV base = fma(side.across, (floatV)aside, -side.q);
                    const ballV ball = ball_at(&side, s);
                    const floatV tilt = fma((floatV)turn_x, LOAD(float, slopes + at), turn_y * LOAD(float, slopes + all + at));
                    const floatV here_q = LOAD(float, fronts + at) + base;
                    const floatV inner = clamp(fma(tilt, (floatV)tap[4], here_q), ball.low, ball.high);
                    const floatV outer = clamp(fma(tilt, (floatV)tap[5], here_q), ball.low, ball.high);
                    const floatV inner_cot = fma(side.scale * tap[6], inner, side.offset);
                    const floatV outer_cot = fma(side.scale * tap[7], outer, side.offset);
                    const floatV top = max(inner_cot, outer_cot);
                    const floatV farther = clamp(LOAD(float, backs + at) + base, ball.low, ball.high);
                    const floatV back_cot = fma(side.scale * (1.0f / s), farther, side.offset);
                    const floatV bottom = min(back_cot, min(inner_cot, outer_cot));
                    const intV hit = (here_q > ball.low) & (farther < ball.high) & (ball.high > ball.low);
                    const intV from = sector(bottom, &side, 0.5f);
                    const intV to = sector(top, &side, 0.5f);
                    covered |= select((intV)0, ((intV)1 << max(from, to)) - ((intV)1 << from), hit);
                }
                const intV active = left_over == now;
                found = select(found, covered, active);
                left_over = select(left_over, (intV)0, active);
            }
            const floatV weighted = weight * full;
            whole += weighted;
            blocked = fma(weighted * (1.0f / SECTORS), convert_floatV(popcount(found)), blocked);
        }
    }
    *(__global float_lanes*)(sums + here) = select((floatV)0.0f, blocked, surface);
    *(__global float_lanes*)(sums + all + here) = select((floatV)0.0f, whole, surface);
}
