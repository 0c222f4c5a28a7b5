// Pixels whose depth was averaged over an edge, as mixed.h finds them: 1, and 0 elsewhere.

#include "dof_masks/mixed.h"

KERNEL void mixed_pixels(__global const float* source, __global float* target, const grid_params grid,
                          const mixed_params p) {
    const uint x = first_column(grid.x_begin, grid.x_end);
    const uint made = get_global_id(1), y = grid.y_begin + made;
    if (x >= grid.x_end || y >= grid.height)
        return;

    const window w = window_at(source, &grid, (int)x, (int)y);
    *(__global float_lanes*)(target + grid.target_offset + (size_t)made * grid.target_stride + x) =
        select((floatV)0.0f, (floatV)1.0f, mixed_at(&w, &p));
}
