// The last pass of dof. What is left of T shows the colour that was found behind the blurred foreground. Where none was
// found, the known part stands for the whole pixel. A pixel that no known colour reaches keeps its own.

#include "vector.h"
#include "pixels.h"
#include "store.h"
#include "dof/tiles.h"

// What was seen hides what is left if a fifth of it has something found behind it, and in proportion below, so that nothing jumps.
#define FILLED 5.0f
#define ALPHA_ROUNDING 0x1p-15f

KERNEL void dof(__global const float* state, __global const ELEMENT_TYPE* color, __global ELEMENT_TYPE* target,
                  const grid_params grid, const blur_params p) {
    const uint column = get_global_id(0) * V, row = get_global_id(1);
    const int x = (int)column - (int)p.left, y = (int)(p.state_row + row) - (int)p.top;
    if (column >= p.columns || y < 0 || y >= (int)p.height || x + V <= 0 || x >= (int)p.width)
        return;
    __global const float* here = state + in_planes(&p, 0, column, row);
    const floatV through = LOAD(float, here);
    const intV unknown = through >= 1.0f;
    floatV result[CHANNELS];
    if (any_of(through != 0.0f)) {
        const floatV hidden = LOAD(float, here + (CHANNELS + 1) * p.state_plane);
        const intV filled = hidden > 0.0f;
        const floatV part = min(FILLED * hidden / (through * (1.0f - through)), 1.0f); // of what is left, that which is filled
        const floatV of_hidden = select((floatV)0.0f, part * through / hidden, filled);
        const floatV left = select(through, (1.0f - part) * through, filled);
        const floatV whole = 1.0f + select((floatV)0.0f, left / (1.0f - through), left > 0.0f);
        for (int k = 0; k < CHANNELS; ++k) {
            const floatV seen = LOAD(float, here + (k + 1) * p.state_plane) * whole;
            const floatV of_behind = of_hidden * LOAD(float, here + (CHANNELS + 2 + k) * p.state_plane);
            result[k] = seen + select((floatV)0.0f, of_behind, filled);
        }
    } else {
        for (int k = 0; k < CHANNELS; ++k)
            result[k] = LOAD(float, here + (k + 1) * p.state_plane);
    }
#if CHANNELS == 4
    const floatV alpha = result[3]; // of pixels that are opaque but for rounding
    result[3] = select(alpha, (floatV)1.0f, (alpha > 1.0f) & (alpha < 1.0f + ALPHA_ROUNDING));
#endif
    const size_t row_target = grid.target_offset + (size_t)y * grid.target_stride;
#if ELEMENT == ELEMENT_FLOAT
    if (x >= 0 && x + V <= (int)p.width && !any_of(unknown)) {
        store_vectors(result[0], result[1], result[2], result[CHANNELS - 1], target + row_target + (size_t)CHANNELS * x);
        return;
    }
#endif
    float one[CHANNELS][V];
    for (int k = 0; k < CHANNELS; ++k)
        *(float_lanes*)one[k] = result[k];
    for (int i = 0; i < V; ++i) {
        if (x + i < 0 || x + i >= (int)p.width)
            continue;
        const size_t at = row_target + (size_t)CHANNELS * (x + i);
        const size_t own = grid.source_offset + (size_t)y * grid.source_stride + (size_t)CHANNELS * (x + i);
        for (int k = 0; k < CHANNELS; ++k)
            write_element(((int*)&unknown)[i] ? read_element(color, own + k) : one[k][i], target, at + k);
    }
}
