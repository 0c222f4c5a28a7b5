// Positions from stored depth, V pixels per work-item.
//   position = origin(x, y) + w direction(x, y)
// w is the view depth, or its quotient by the depth that one step of the direction covers where the projection's fourth
// row has x and y. View and world space, perspective and orthographic differ in constants only.
// Lenaerts, positions from depth; docs/camera.md.

#include "camera.h"

#if !defined(CHANNELS) || CHANNELS < 3 || CHANNELS > 4
#error "CHANNELS is not defined: 3 or 4 floats a position"
#endif

#if CHANNELS == 3
#define XYZ(i) x.s##i, y.s##i, z.s##i
#else
#define XYZW(i) x.s##i, y.s##i, z.s##i, w.s##i
#endif

// Lanes to neighbours in memory: x0 y0 z0 x1 y1 z1 ...
INLINE void store_positions(floatV x, floatV y, floatV z, __global float* target) {
#if CHANNELS == 4
    const floatV w = select((floatV)1.0f, (floatV)0.0f, isnan(z));
#endif
#if V == 1
    target[0] = x;
    target[1] = y;
    target[2] = z;
#if CHANNELS == 4
    target[3] = w;
#endif
#elif CHANNELS == 3 && V == 4
    store_float((floatV)(XYZ(0), x.s1), target);
    store_float((floatV)(y.s1, z.s1, x.s2, y.s2), target + 4);
    store_float((floatV)(z.s2, XYZ(3)), target + 8);
#elif CHANNELS == 3 && V == 8
    store_float((floatV)(XYZ(0), XYZ(1), x.s2, y.s2), target);
    store_float((floatV)(z.s2, XYZ(3), XYZ(4), x.s5), target + 8);
    store_float((floatV)(y.s5, z.s5, XYZ(6), XYZ(7)), target + 16);
#elif CHANNELS == 3
    store_float((floatV)(XYZ(0), XYZ(1), XYZ(2), XYZ(3), XYZ(4), x.s5), target);
    store_float((floatV)(y.s5, z.s5, XYZ(6), XYZ(7), XYZ(8), XYZ(9), x.sa, y.sa), target + 16);
    store_float((floatV)(z.sa, XYZ(b), XYZ(c), XYZ(d), XYZ(e), XYZ(f)), target + 32);
#elif V == 4
    store_float((floatV)(XYZW(0)), target);
    store_float((floatV)(XYZW(1)), target + 4);
    store_float((floatV)(XYZW(2)), target + 8);
    store_float((floatV)(XYZW(3)), target + 12);
#elif V == 8
    store_float((floatV)(XYZW(0), XYZW(1)), target);
    store_float((floatV)(XYZW(2), XYZW(3)), target + 8);
    store_float((floatV)(XYZW(4), XYZW(5)), target + 16);
    store_float((floatV)(XYZW(6), XYZW(7)), target + 24);
#else
    store_float((floatV)(XYZW(0), XYZW(1), XYZW(2), XYZW(3)), target);
    store_float((floatV)(XYZW(4), XYZW(5), XYZW(6), XYZW(7)), target + 16);
    store_float((floatV)(XYZW(8), XYZW(9), XYZW(a), XYZW(b)), target + 32);
    store_float((floatV)(XYZW(c), XYZW(d), XYZW(e), XYZW(f)), target + 48);
#endif
}

INLINE floatV along_ray(const wide* origin, const wide* direction, floatV w, uint x, uint y) {
    return wide_to_float(wide_multiply_add(wide_at_pixel(direction, x, y), w, wide_at_pixel(origin, x, y)));
}

__kernel void unproject(__global const STORED* source, __global float* target, const grid_params grid,
                        const depth_params depth, const ray_params view_rays, const ray_params rays) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint y = get_global_id(1);
    if (x >= grid.x_end || y >= grid.height)
        return;

    const uint px = grid.pixel_x + x, py = grid.pixel_y + y;
    const sampleV sample = load_stored(source, &grid, x, y, &depth);
    const floatV z = view_depth(sample, px, py, &depth, &view_rays);
#if PARALLEL_DEPTH
    const floatV along = z;
#else
    const wideV beyond_eye = wide_add(wide_from(z), wide_negative(wide_constant(rays.eye_depth)));
    const floatV along = wide_quotient(beyond_eye, wide_at_pixel(rays.depth, px, py));
#endif
    const floatV w = select(along, (floatV)NAN, isinf(along)); // the background lies at no place
    store_positions(along_ray(rays.origin[0], rays.direction[0], w, px, py),
                    along_ray(rays.origin[1], rays.direction[1], w, px, py),
                    along_ray(rays.origin[2], rays.direction[2], w, px, py),
                    target + grid.target_offset + (size_t)y * grid.target_stride + (size_t)CHANNELS * x);
}
