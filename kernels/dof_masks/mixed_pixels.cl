// Pixels whose depth was averaged over an edge: they lie on neither of the surfaces beside them, but between these.
//   left = 2 before1 - before2,  right = 2 after1 - after2       inverse depth of the planes on both sides at the pixel
// along a row or a column of inverse depth, which is affine on every plane: two-tap extrapolation as in slope.h (atyuwen 2020).
// A pixel is mixed if it lies between left and right, and between its two neighbours, and is away from each by more than
// min_step of the step from left to right and by more than rounding. The step must also be larger than the slopes beside it
// make, as they do on a curve, and as deep as some pixels are wide, which the steps of a rough surface are not.
// It must lie between its neighbours too, since two taps on an object two pixels wide predict nothing. If one of the
// four values is NaN, the pixel is not mixed.
// The output is 1 for such a pixel and 0 elsewhere, or positions, of which those of such pixels become NaN and their w 0.
// Built for: CHANNELS = 1 3 4

#include "params.h"
#include "camera/window.h"

#if !defined(CHANNELS) || (CHANNELS != 1 && CHANNELS != 3 && CHANNELS != 4)
#error "CHANNELS is not defined: 1 to write which pixels are mixed, 3 or 4 floats of a position to leave them out"
#endif

#define STEEP 0.5f // slopes per step: four pixels mixed in a row, as wide filters make them, are 1 apart of 3

INLINE intV mixed(floatV before2, floatV before1, floatV centre, floatV after1, floatV after2, floatV tolerance,
                  floatV widths, float min_step) {
    const floatV slope_before = before1 - before2, slope_after = after2 - after1;
    const floatV left = before1 + slope_before, right = after1 - slope_after, step = right - left;
    const floatV size = fabs(step), least = max(min_step * size, tolerance);
    const floatV way = sign(step);
    const floatV from_left = min((centre - left) * way, (centre - before1) * way);
    const floatV from_right = min((right - centre) * way, (after1 - centre) * way);
    return (from_left > least) & (from_right > least) & (size > STEEP * (fabs(slope_before) + fabs(slope_after))) &
           (size > widths) & (size < INFINITY);
}

INLINE intV mixed_at(const window* w, const mixed_params* p) {
    const floatV q = neighbour(w, 0, 0);
    const floatV west = neighbour(w, -1, 0), east = neighbour(w, 1, 0);
    const floatV north = neighbour(w, 0, -1), south = neighbour(w, 0, 1);
    const floatV size = fmax(fmax(fabs(west), fabs(east)), fmax(fabs(north), fabs(south))); // of those that are there
    const floatV error =
        fma(fma((floatV)p->error_quadratic, size, (floatV)p->error_linear), size, (floatV)p->error_constant);
    const floatV tolerance = 4.0f * error, widths = fma((floatV)p->step_linear, fabs(q), (floatV)p->step_constant);
    const intV in_row =
        mixed(neighbour(w, -2, 0), west, q, east, neighbour(w, 2, 0), tolerance, widths, p->min_step);
    const intV in_column =
        mixed(neighbour(w, 0, -2), north, q, south, neighbour(w, 0, 2), tolerance, widths, p->min_step);
    return in_row | in_column;
}

KERNEL void mixed_pixels(__global const float* source, __global float* target, const grid_params grid,
                          const mixed_params p) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint made = get_global_id(1), y = grid.y_begin + made;
    if (x >= grid.x_end || y >= grid.height)
        return;

    const window w = window_at(source, &grid, (int)x, (int)y);
    const intV is_mixed = mixed_at(&w, &p);
    __global float* out = target + grid.target_offset + (size_t)made * grid.target_stride + (size_t)CHANNELS * x;
#if CHANNELS == 1
    *(__global float_lanes*)out = select((floatV)0.0f, (floatV)1.0f, is_mixed);
#else
    if (!any_of(is_mixed))
        return;
    uint lanes[V];
    *(uint_lanes*)lanes = as_uintV(is_mixed);
    for (int i = 0; i < V; ++i, out += CHANNELS)
        if (lanes[i] != 0) {
            out[0] = out[1] = out[2] = NAN;
#if CHANNELS == 4
            out[3] = 0.0f;
#endif
        }
#endif
}
