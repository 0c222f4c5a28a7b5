// Joint upsampling: from a result for every second pixel of every second row to all of them. Pixels that have none of their own
// take those on either side, by how near they lie to these's tangent planes in planar depth; where none does, the nearest counts.
// Kopf et al. 2007, "Joint Bilateral Upsampling"; the weight is that of kernels/denoise.cl. The text of kernels/ray.h and
// kernels/slope.h stands before this, for one lane.

// Stored values of every second pixel of every second row.
__kernel void half_stored(__global const float* stored, __global float* target, const grid_params grid) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x < (int)grid.x_end)
        target[(size_t)y * grid.target_stride + x] =
            stored[grid.source_offset + (size_t)(2 * y) * grid.source_stride + 2 * x];
}

INLINE float there_or_nothing(__global const float* depth, const grid_params* grid, int x, int y) {
    const bool inside = x >= 0 && y >= 0 && 2 * x < (int)grid->x_end && 2 * y < (int)grid->height;
    return inside ? surface_only(depth[(size_t)(2 * y) * grid->source_stride + 2 * x]) : NAN;
}

// Slopes of the half image, per pixel of the whole one.
__kernel void half_slopes(__global const float* depth, __global float* slopes, const grid_params grid,
                          const occlusion_params p) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (2 * x >= (int)grid.x_end)
        return;
    const float q = depth[(size_t)(2 * y) * grid.source_stride + 2 * x], tolerance = 4 * depth_error(&p, q);
    const size_t at = 2 * ((size_t)y * grid.target_stride + x);
#define THERE(dx, dy) there_or_nothing(depth, &grid, x + (dx), y + (dy))
    slopes[at] = 0.5f * slope(THERE(-2, 0), THERE(-1, 0), q, THERE(1, 0), THERE(2, 0), tolerance);
    slopes[at + 1] = 0.5f * slope(THERE(0, -2), THERE(0, -1), q, THERE(0, 1), THERE(0, 2), tolerance);
}

__kernel void joint_upsample(__global const float* depth, __global const float* slopes,
                             __global const float* half_result, __global float* target, const grid_params grid,
                             const grid_params half_grid, const occlusion_params p) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x >= (int)grid.x_end)
        return;
    const float q = depth[(size_t)y * grid.source_stride + x];
    const float width = PERSPECTIVE ? fabs(q) * p.pixel : p.pixel, error = 4 * depth_error(&p, q);
    float sum = 0, whole = 0;
    for (int i = 0; i < 4; ++i) {
        const int hx = min((x + (i & 1)) >> 1, (int)half_grid.x_end - 1);
        const int hy = min((y + (i >> 1)) >> 1, (int)half_grid.height - 1);
        const float there = depth[(size_t)(2 * hy) * grid.source_stride + 2 * hx];
        const size_t at = (size_t)hy * half_grid.target_stride + hx;
        const float right = slopes[2 * at], down = slopes[2 * at + 1];
        const float off = fabs(q - there - fma(right, (float)(x - 2 * hx), down * (float)(y - 2 * hy)));
        const float edge = fma(p.edge, sqrt(fma(width, width, fma(right, right, down * down))), error);
        const float value = half_result[(size_t)hy * half_grid.source_stride + hx];
        const bool counts = off < INFINITY && !isnan(value) && surface_only(there) == there;
        const float weight = counts ? max(1 - off / edge, 0.0f) + 1e-4f * edge / (edge + off) : 0.0f;
        sum += counts ? weight * value : 0.0f;
        whole += weight;
    }
    const bool surface = PERSPECTIVE ? q > 0 : q > -INFINITY;
    target[grid.target_offset + (size_t)y * grid.target_stride + x] = isnan(q)               ? NAN
                                                                      : surface && whole > 0 ? sum / whole
                                                                                             : 1.0f;
}
