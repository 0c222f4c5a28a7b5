// What the bench compares with: copies that move the same bytes, and the formulas that engines and simulators use.
// V pixels per work-item with ordinary loads and stores, as a careful user of OpenCL would write them.

#include "vector.h"

#define FRAME __global const float *source, __global float *target, const grid_params grid
#define PIXELS(channels)                                                                                               \
    const uint x = first_column(grid.x_begin, grid.x_end), y = get_global_id(1);                                       \
    if (x >= grid.x_end || y >= grid.height) return;                                                                   \
    const floatV d = LOAD(float, source + (size_t)y * grid.source_stride + x);                                         \
    __global float* out = target + (size_t)y * grid.target_stride + channels * x;

__kernel void copy(FRAME) {
    PIXELS(1)
    store_float(d, out);
}

// Read, write back: what working in place moves.
__kernel void rewrite(FRAME) {
    PIXELS(1)
    READ_AHEAD(source + (size_t)y * grid.source_stride + x);
    store_float(d * 0.5f, out);
}

// One float in, three out: what unproject moves.
__kernel void spread(FRAME) {
    PIXELS(3)
    store_float(d, out);
    store_float(d, out + V);
    store_float(d, out + 2 * V);
}

// One float in, four out: what dof_masks moves.
__kernel void fan_out(FRAME) {
    PIXELS(4)
    for (int i = 0; i < 4; ++i)
        store_float(d, out + i * V);
}

// The same into four images, as dof_masks does it.
__kernel void fan_out_apart(__global const float* source, __global float* first, __global float* second,
                            __global float* third, __global float* fourth, const grid_params grid) {
    const uint x = first_column(grid.x_begin, grid.x_end), y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height) return;
    const floatV d = LOAD(float, source + (size_t)y * grid.source_stride + x);
    const size_t at = (size_t)y * grid.target_stride + x;
    store_float(d, first + at);
    store_float(d, second + at);
    store_float(d, third + at);
    store_float(d, fourth + at);
}

// Blur by a gather with the circle of the pixel itself, as tutorials have it: red, green and blue of all pixels within it,
// whatever their own circles.
__kernel void centre_gather(__global const float* circles, __global const float* color, __global float* target,
                            const int width, const int height) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width) return;
    const float radius = 0.5f * fabs(circles[y * width + x]), square = radius * radius;
    const int reach = (int)radius;
    float3 sum = 0;
    int count = 0;
    for (int dy = max(-reach, -y); dy <= min(reach, height - 1 - y); ++dy) {
        const int across = (int)sqrt(max(square - dy * dy, 0.0f));
        const int low = max(x - across, 0), high = min(x + across, width - 1);
        __global const float* from = color + 3 * ((size_t)(y + dy) * width + low);
        for (int i = low; i <= high; ++i, from += 3)
            sum += (float3)(from[0], from[1], from[2]);
        count += high - low + 1;
    }
    vstore3(sum / count, (size_t)y * width + x, target);
}

// As engines do (Jimenez 2014): 49 samples in three rings over the max CoC of the tiles around. A sample counts if its
// circle reaches the pixel, weighted by 1 / the circle's area. A sample that lies farther has at most the pixel's own
// circle.
__kernel void ring_gather(__global const float* circles, __global const float* least, __global const float* greatest,
                          __global const float* color, __global float* target, const int width, const int height,
                          const int tile, const int stride) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width) return;
    const int across = (width + tile - 1) / tile, down = (height + tile - 1) / tile;
    float largest = 0.0f;
    for (int j = max(y / tile - 1, 0); j <= min(y / tile + 1, down - 1); ++j)
        for (int i = max(x / tile - 1, 0); i <= min(x / tile + 1, across - 1); ++i)
            largest = fmax(largest, fmax(fabs(least[j * stride + i]), fabs(greatest[j * stride + i])));
    const size_t here = (size_t)y * width + x;
    const float own = circles[here];
    float weight = 1.0f / fmax(own * own, 1.0f);
    float3 sum = weight * vload3(here, color);
    for (int ring = 1; ring <= 3; ++ring) {
        const float away = largest * (0.5f / 3.0f) * ring;
        const float2 turn = ring == 1 ? (float2)(0.70710678f, 0.70710678f) // by an eighth, a sixteenth, a twenty-fourth
                                      : ring == 2 ? (float2)(0.92387953f, 0.38268343f) : (float2)(0.96592583f, 0.25881905f);
        float2 at = (float2)(away, 0.0f);
        for (int i = 0; i < 8 * ring; ++i, at = (float2)(at.x * turn.x - at.y * turn.y, at.x * turn.y + at.y * turn.x)) {
            const int column = clamp((int)(x + 0.5f + at.x), 0, width - 1);
            const int row = clamp((int)(y + 0.5f + at.y), 0, height - 1);
            const size_t there = (size_t)row * width + column;
            const float its = circles[there], size = its > own ? fmin(fabs(its), fabs(own)) : fabs(its);
            const float fraction = 0.5f * size >= away - 0.5f ? 1.0f / fmax(size * size, 1.0f) : 0.0f;
            sum += fraction * vload3(there, color);
            weight += fraction;
        }
    }
    vstore3(sum / weight, here, target);
}

// 1 / (Z d + W), both constants in float: Unity's and Unreal's way.
__kernel void engine_fma(FRAME, const float z, const float w) {
    PIXELS(1)
    store_float(1.0f / (z * d + w), out);
}

// 2 n f / (f + n - (2 d - 1)(f - n)): OpenGL tutorials.
__kernel void tutorial_ndc(FRAME, const float near, const float far) {
    PIXELS(1)
    const floatV ndc = d * 2.0f - 1.0f;
    store_float(2.0f * near * far / (far + near - ndc * (far - near)), out);
}

// n f / (f - (f - n) d): robot simulators.
__kernel void simulator_ratio(FRAME, const float near, const float far) {
    PIXELS(1)
    store_float(near * far / (far - (far - near) * d), out);
}

// n (f / n)^d with the builtin.
__kernel void builtin_exponential(FRAME, const float near, const float rate) {
    PIXELS(1)
    store_float(near * exp2(rate * d), out);
}

// The point of a pixel by the whole inverse of viewport and projection, four rows of four floats.
INLINE float3 point_at(__global const float* stored, float16 rows, int stride, int x, int y) {
    const float4 q = (float4)(x + 0.5f, y + 0.5f, stored[(size_t)y * stride + x], 1);
    return (float3)(dot(rows.s0123, q), dot(rows.s4567, q), dot(rows.s89ab, q)) / dot(rows.scdef, q);
}

__kernel void matrix_position(__global const float* stored, __global float* target, const float16 rows, const int width,
                              const int height, const int stride, const int target_stride) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width) return;
    const float3 p = point_at(stored, rows, stride, x, y);
    vstore3(p, x, target + (size_t)y * target_stride);
}

// The normal of the pixel, its right and its lower neighbour, as most shaders have it.
__kernel void cross_normals(__global const float* stored, __global float* target, const float16 rows, const int width,
                            const int height, const int stride, const int target_stride) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width) return;
    const int left = min(x, width - 2), top = min(y, height - 2);
    const float3 p = point_at(stored, rows, stride, left, top);
    const float3 right = point_at(stored, rows, stride, left + 1, top) - p;
    const float3 down = point_at(stored, rows, stride, left, top + 1) - p;
    vstore3(normalize(cross(down, right)), x, target + (size_t)y * target_stride);
}
