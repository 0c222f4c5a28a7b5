// Takes the positions of pixels away whose depth was averaged over an edge: they become NaN, and w becomes 0.
// Built for: CHANNELS = 3 4

#include "dof_masks/mixed.h"

#if !defined(CHANNELS) || CHANNELS < 3 || CHANNELS > 4
#error "CHANNELS is not defined: 3 or 4 floats a position"
#endif

KERNEL void leave_out_mixed(__global const float* source, __global float* target, const grid_params grid,
                            const mixed_params p) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint made = get_global_id(1), y = grid.y_begin + made;
    if (x >= grid.x_end || y >= grid.height)
        return;

    const window w = window_at(source, &grid, (int)x, (int)y);
    const intV is_mixed = mixed_at(&w, &p);
    if (!any_of(is_mixed))
        return;
    uint lanes[V];
    *(uint_lanes*)lanes = as_uintV(is_mixed);
    __global float* position = target + grid.target_offset + (size_t)made * grid.target_stride + (size_t)CHANNELS * x;
    for (int i = 0; i < V; ++i, position += CHANNELS)
        if (lanes[i] != 0) {
            position[0] = position[1] = position[2] = NAN;
#if CHANNELS == 4
            position[3] = 0.0f;
#endif
        }
}
