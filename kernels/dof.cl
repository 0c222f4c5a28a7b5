// The last pass of dof. What is left of T shows the colour that was found behind the blurred foreground. Where none was
// found, the known part stands for the whole pixel. A pixel that no known colour reaches keeps its own.

#include "vector.h"
#include "pixels.h"
#include "tiles.h"

__kernel void dof(__global const float* state, __global const ELEMENT_TYPE* color, __global ELEMENT_TYPE* target,
                  const grid_params grid, const blur_params p) {
    const uint column = get_global_id(0) * V, row = get_global_id(1);
    const int x = (int)column - (int)p.left, y = (int)row - (int)p.top;
    if (column >= p.columns || y < 0 || y >= (int)p.height || x + V <= 0 || x >= (int)p.width)
        return;
    __global const float* here = state + in_planes(&p, 0, column, row);
    const floatV through = LOAD(float, here), hidden = LOAD(float, here + (CHANNELS + 1) * p.plane);
    const intV filled = hidden > 0.0f;
    const floatV of_hidden = select((floatV)0.0f, through / hidden, filled);
    const floatV whole = select(1.0f / (1.0f - through), (floatV)1.0f, filled);
    const intV unknown = through >= 1.0f;
    float result[CHANNELS][V];
    for (int k = 0; k < CHANNELS; ++k) {
        const floatV seen = LOAD(float, here + (k + 1) * p.plane) * whole;
        const floatV behind = select((floatV)0.0f, of_hidden * LOAD(float, here + (CHANNELS + 2 + k) * p.plane), filled);
        *(float_lanes*)result[k] = seen + behind;
    }
    for (int i = 0; i < V; ++i) {
        if (x + i < 0 || x + i >= (int)p.width)
            continue;
        const size_t at = grid.target_offset + (size_t)y * grid.target_stride + (size_t)CHANNELS * (x + i);
        const size_t own = grid.source_offset + (size_t)y * grid.source_stride + (size_t)CHANNELS * (x + i);
        for (int k = 0; k < CHANNELS; ++k)
            write_element(((int*)&unknown)[i] ? read_element(color, own + k) : result[k][i], target, at + k);
    }
}
