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

// Popov 2016, listing 1: what is not depth is a term of the vertices, here the image's corners from the top left, row by
// row, where w is 1; it is interpolated, and divided by the interpolated w.
INLINE floatV vertex_term(const grid_params grid, uint x, uint y, float4 corners) {
    const floatV across = vector_from(x) * (1.0f / (float)grid.x_end);
    const float down = ((float)y + 0.5f) * (1.0f / (float)grid.height);
    return mix(mix((floatV)corners.x, (floatV)corners.y, across), mix((floatV)corners.z, (floatV)corners.w, across),
               (floatV)down);
}

__kernel void popov_perspective(FRAME, const float scale, const float a, const float b, const float c, const float d_) {
    PIXELS(1)
    store_float(1.0f / (d * scale + vertex_term(grid, x, y, (float4)(a, b, c, d_))), out);
}

// Without the reciprocal, as the article says of orthographic projections.
__kernel void popov_orthographic(FRAME, const float scale, const float a, const float b, const float c, const float d_) {
    PIXELS(1)
    store_float(d * scale + vertex_term(grid, x, y, (float4)(a, b, c, d_)), out);
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

// Lenaerts 2014: z = -(d m44 - m43) / (d m34 - m33), P = O + z D. O, D and, for oblique near planes after Popov, m33 are
// interpolated between the image's corners; `rays` holds D and m33 of the four, `origins` O, `m` is (m34, m43, m44) and
// `clip` what makes d normalised depth of the stored one.
__kernel void interpolated_rays(__global const float* stored, __global float* target, const float16 rays,
                                const float16 origins, const float4 m, const float2 clip, const int width,
                                const int height, const int stride, const int target_stride) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width) return;
    const float across = (x + 0.5f) / width, down = (y + 0.5f) / height;
    const float4 ray = mix(mix(rays.s0123, rays.s4567, across), mix(rays.s89ab, rays.scdef, across), down);
    const float4 origin = mix(mix(origins.s0123, origins.s4567, across), mix(origins.s89ab, origins.scdef, across), down);
    const float d = stored[(size_t)y * stride + x] * clip.x + clip.y;
    const float z = -(d * m.z - m.y) / (d * m.x - ray.w);
    vstore3(origin.xyz + z * ray.xyz, x, target + (size_t)y * target_stride);
}

// Distances and a pinhole's fx, fy, cx, cy: fy is negative, since rows go down and y goes up.
typedef struct {
    __global const float* z;
    int stride, width, height;
    float4 pinhole;
} depth_image;

INLINE float z_at(const depth_image* image, int x, int y) {
    return image->z[(size_t)clamp(y, 0, image->height - 1) * image->stride + clamp(x, 0, image->width - 1)];
}

INLINE float absolute_or_infinite(float x) {
    return x - x == 0.0f ? fabs(x) : INFINITY;
}

// How much depth bends at a pixel along one axis, or both: infinite outside the image and beside what is infinitely far.
INLINE float bend(const depth_image* image, int x, int y, int dx, int dy) {
    if (x < 0 || y < 0 || x >= image->width || y >= image->height) return INFINITY;
    return absolute_or_infinite(z_at(image, x - dx, y - dy) - 2 * z_at(image, x, y) + z_at(image, x + dx, y + dy));
}
INLINE float bend_of_both(const depth_image* image, int x, int y) {
    if (x < 0 || y < 0 || x >= image->width || y >= image->height) return INFINITY;
    return absolute_or_infinite(4 * z_at(image, x, y) - z_at(image, x - 1, y) - z_at(image, x + 1, y) -
                                z_at(image, x, y - 1) - z_at(image, x, y + 1));
}

// The gradient on either side, weighted by e^-bend of the neighbour there; where the weights' ratio is beyond e, one side's.
INLINE float aware_gradient(const depth_image* image, int x, int y, int dx, int dy) {
    const float z = z_at(image, x, y);
    const float before = bend(image, x - dx, y - dy, dx, dy), after = bend(image, x + dx, y + dy, dx, dy);
    const float more = before - after;
    const float weight = more > 1 ? 0.0f : more < -1 ? 1.0f : 1.0f / (1.0f + exp(more));
    float gradient = 0.0f;
    if (weight > 0) gradient += weight * (z - z_at(image, x - dx, y - dy));
    if (weight < 1) gradient += (1 - weight) * (z_at(image, x + dx, y + dy) - z);
    return gradient;
}

// D2NT v3 (Feng et al., ICRA 2023): n = (fx dz/du, fy dz/dv, -(z + (u - cx) dz/du + (v - cy) dz/dv)) with gradients that
// avoid discontinuities; refined by taking the normal of that pixel, among itself and its four neighbours, whose depth
// bends the least.
__kernel void d2nt(__global const float* depth, __global float* target, const float4 pinhole, const int width,
                   const int height, const int stride, const int target_stride) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width) return;
    const depth_image image = {depth, stride, width, height, pinhole};
    int u = x, v = y;
    float least = bend_of_both(&image, x, y);
    for (int i = 0; i < 4; ++i) {
        const int column = x + (i == 1) - (i == 0), row = y + (i == 3) - (i == 2);
        const float its = bend_of_both(&image, column, row);
        u = its < least ? column : u, v = its < least ? row : v;
        least = fmin(its, least);
    }
    const float right = aware_gradient(&image, u, v, 1, 0), down = aware_gradient(&image, u, v, 0, 1);
    const float ahead = -(z_at(&image, u, v) + (u + 0.5f - pinhole.z) * right + (v + 0.5f - pinhole.w) * down);
    vstore3(normalize((float3)(pinhole.x * right, pinhole.y * down, -ahead)), x, target + (size_t)y * target_stride);
}

#define ORDER(a, b) { const float low = fmin(a, b); b = fmax(a, b); a = low; }

// 3F2N (Fan et al., RA-L 2021): nx = fx d(1/z)/du, ny = fy d(1/z)/dv by central differences, and nz is the median over the
// eight neighbours of -(nx dX + ny dY) / dZ.
__kernel void three_filters(__global const float* depth, __global float* target, const float4 pinhole, const int width,
                            const int height, const int stride, const int target_stride) {
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= width) return;
    const depth_image image = {depth, stride, width, height, pinhole};
    const float z = z_at(&image, x, y), across = x + 0.5f - pinhole.z, down = y + 0.5f - pinhole.w;
    const int columns = (x > 0) + (x < width - 1), rows = (y > 0) + (y < height - 1); // one beside the border
    const float nx = pinhole.x * (1 / z_at(&image, x + 1, y) - 1 / z_at(&image, x - 1, y)) / columns;
    const float ny = pinhole.y * (1 / z_at(&image, x, y + 1) - 1 / z_at(&image, x, y - 1)) / rows;
    float nz[8];
    int count = 0;
    for (int j = -(y > 0); j <= (y < height - 1); ++j) {
        for (int i = -(x > 0); i <= (x < width - 1); ++i) {
            const float there = z_at(&image, x + i, y + j);
            const float dx = ((across + i) * there - across * z) / pinhole.x, dy = ((down + j) * there - down * z) / pinhole.y;
            const float found = -(nx * dx + ny * dy) / (there - z);
            if ((i || j) && found == found) nz[count++] = found;
        }
    }
    for (int i = 1; i < count; ++i)
        for (int j = i; j > 0; --j)
            ORDER(nz[j - 1], nz[j])
    const float ahead = count > 0 ? 0.5f * (nz[count / 2] + nz[(count - 1) / 2]) : -1.0f;
    const float3 n = isinf(ahead) ? (float3)(0, 0, 1) : normalize((float3)(nx, ny, -ahead));
    const float towards = n.x * across / pinhole.x + n.y * down / pinhole.y - n.z;
    vstore3(towards > 0 ? -n : n, x, target + (size_t)y * target_stride);
}
