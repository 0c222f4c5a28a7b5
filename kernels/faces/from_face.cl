// From a pinhole's result back to the pixels of the lens's image: of the four pixels around a ray, weighted bilinearly and by how
// near they lie to the pixel's tangent plane, as joint_upsample.cl does.
// Built for: LENS = 1; OUTPUT = 0 1 2

#include "camera/patch.h"
#include "faces/face.h"
#include "ssao/upsampled.h"

typedef float2 __attribute__((aligned(4))) float2_lanes;

KERNEL void from_face(__global const float* planes, __global const float* depth, __global const float* results,
                      __global float* target, const grid_params grid, const face_params p,
                      const from_face_params from LENS_ARGUMENTS) {
    const uint x = first_column(grid.x_begin, grid.x_end), y = (uint)get_global_id(1) + grid.y_begin;
    if (x >= grid.x_end)
        return;
    const patch_rayV ray = patch_rays(tiles, nodes, &lens, grid.pixel_x + x, grid.pixel_y + y);
    const floatV u[3] = {ray.x.high + ray.x.low, ray.y.high + ray.y.low, ray.z.high + ray.z.low};
    floatV part[3]; // right, down, ahead
    for (int i = 0; i < 3; ++i)
        part[i] = fma(u[0], (floatV)from.unit[0][i], fma(u[1], (floatV)from.unit[1][i], u[2] * from.unit[2][i]));
    const floatV scale = 1.0f / (part[2] * p.pixel);
    // Pixels of the face, from the middle of its first one.
    const floatV column = clamp(part[0] * scale - p.first[0], (floatV)(float)from.first_column, (floatV)(float)from.last_column);
    const floatV row = clamp(part[1] * scale - p.first[1], (floatV)(float)from.first_row, (floatV)(float)from.last_row);
    const floatV left = min(floor(column), (floatV)(float)(from.last_column - 1)),
                 top = min(floor(row), (floatV)(float)(from.last_row - 1));
    const floatV s = column - left, t = row - top;

    float seen[4][V], values[4][CHANNELS][V];
    const intV there = (left >= 0.0f) & (top >= 0.0f); // not where there is no ray
    const intV column_of = select((intV)from.first_column, convert_intV(left), there);
    const intV row_of = select((intV)from.first_row, convert_intV(top), there);
    const int_lanes at_depth = row_of * (int)p.stride + column_of;
    const int_lanes at_result =
        (row_of - from.first_row) * (int)from.stride + CHANNELS * (column_of - from.first_column);
    for (int i = 0; i < V; ++i) {
        __global const float* const its = depth + ((const int*)&at_depth)[i];
        const float2 above = *(__global const float2_lanes*)its, below = *(__global const float2_lanes*)(its + p.stride);
        seen[0][i] = above.x;
        seen[1][i] = above.y;
        seen[2][i] = below.x;
        seen[3][i] = below.y;
        __global const float* const result = results + ((const int*)&at_result)[i];
        for (int c = 0; c < CHANNELS; ++c) {
            values[0][c][i] = result[c];
            values[1][c][i] = result[CHANNELS + c];
            values[2][c][i] = result[from.stride + c];
            values[3][c][i] = result[from.stride + CHANNELS + c];
        }
    }
    const face_planeV plane = planes_at(planes, (intV)(int)(y * p.plane_stride + x) + LANE_INDEX(int), &p);
    const floatV face_x = left + p.first[0], face_y = top + p.first[1];
#if OUTPUT != 2
    floatV whole = 0.0f;
#endif
    floatV sum[CHANNELS];
    for (int c = 0; c < CHANNELS; ++c)
        sum[c] = 0.0f;
    const floatV steep = fma(plane.right, plane.right, plane.down * plane.down);
    for (int k = 0; k < 4; ++k) {
        const floatV bilinear = (k & 1 ? s : 1.0f - s) * (k >> 1 ? t : 1.0f - t);
        const floatV expected = on_face(&p, &plane, face_x + (float)(k & 1), face_y + (float)(k >> 1));
        const floatV q = *(const float_lanes*)seen[k], size = expected * p.pixel;
        const floatV edge = fma((floatV)from.edge, sqrt(fma(size, size, steep)), from.error * expected);
        const floatV off = fabs(expected - q);
        const floatV weight = bilinear * max(1.0f - off / edge, 0.0f) + NEAREST * (bilinear + NEAREST) * edge / (edge + off);
        const intV counts = (off < INFINITY) & (q > 0.0f);
#if OUTPUT != 2
        whole += select((floatV)0.0f, weight, counts);
#endif
        for (int c = 0; c < CHANNELS; ++c)
            sum[c] += select((floatV)0.0f, weight * *(const float_lanes*)values[k][c], counts);
    }
    const intV known = !isnan(plane.q), surface = plane.q > 0.0f;
    __global float* const to = target + grid.target_offset + (size_t)(y - from.y) * grid.target_stride + CHANNELS * (x - from.x);
#if OUTPUT == 2
    floatV turned[3];
    for (int i = 0; i < 3; ++i)
        turned[i] = fma(sum[0], (floatV)from.unit[i][0], fma(sum[1], (floatV)from.unit[i][1], sum[2] * from.unit[i][2]));
    const floatV length = sqrt(fma(turned[0], turned[0], fma(turned[1], turned[1], turned[2] * turned[2])));
    for (int c = 0; c < 3; ++c) {
        const floatV one = select((floatV)0.0f, turned[c] / length, surface & (length > 0.0f));
        const float_lanes value = select((floatV)NAN, one, known);
        for (int i = 0; i < V; ++i)
            to[3 * i + c] = ((const float*)&value)[i];
    }
#else
    const floatV mean = min(max(sum[0] / whole, 0.0f), 1.0f);
    const floatV unknown = OUTPUT == 0 ? 1.0f : 0.0f;
    const floatV found = select((floatV)1.0f, select(unknown, mean, whole > 0.0f), surface);
    store_float(select((floatV)NAN, found, known), to);
#endif
}
