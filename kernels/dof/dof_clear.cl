// The state before the first layer: all of the lens is left, and no colour has been added. No foreground limits yet
// what is left to wide circles.
// Built for: PLANES = 10 12 13 15; WIDE = 0 1

#include "dof/tiles.h"

#if !defined(PLANES) || !defined(WIDE)
#error "PLANES and WIDE are not defined: planes of the state, and 1 where the last is what is left to wide circles, 0 otherwise"
#endif

KERNEL void dof_clear(__global float* state, const blur_params p) {
    const uint column = get_global_id(0) * V, row = get_global_id(1);
    if (column >= p.stride)
        return;
    __global float* here = state + (size_t)row * p.stride + column;
    store_float(1.0f, here);
    for (int k = 1; k < PLANES - WIDE; ++k)
        store_float(0.0f, here + k * p.state_plane);
#if WIDE
    store_float(INFINITY, here + (PLANES - 1) * p.state_plane);
#endif
}
