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

// The compilers of CPU devices, which alone take V > 1, are all clang.
#define SHUFFLE __builtin_shufflevector

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
    // Two permutations a store: written as literals, clang makes eight of each.
    const floatV xy0 = SHUFFLE(x, y, 0, 16, -1, 1, 17, -1, 2, 18, -1, 3, 19, -1, 4, 20, -1, 5);
    const floatV xy1 = SHUFFLE(x, y, 21, -1, 6, 22, -1, 7, 23, -1, 8, 24, -1, 9, 25, -1, 10, 26);
    const floatV xy2 = SHUFFLE(x, y, -1, 11, 27, -1, 12, 28, -1, 13, 29, -1, 14, 30, -1, 15, 31, -1);
    store_float(SHUFFLE(xy0, z, 0, 1, 16, 3, 4, 17, 6, 7, 18, 9, 10, 19, 12, 13, 20, 15), target);
    store_float(SHUFFLE(xy1, z, 0, 21, 2, 3, 22, 5, 6, 23, 8, 9, 24, 11, 12, 25, 14, 15), target + 16);
    store_float(SHUFFLE(xy2, z, 26, 1, 2, 27, 4, 5, 28, 7, 8, 29, 10, 11, 30, 13, 14, 31), target + 32);
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
