// What the device makes of quotients, square roots and fused products, V cases per work-item.
// The host knows the right results: src/runtime/probe.cpp.

#include "vector.h"

KERNEL void arithmetic(__global const float* a, __global const float* b, __global const float* c, __global float* results,
                         const probe_params p) {
    const uint x = (uint)get_global_id(0) * V;
    if (x >= p.cases)
        return;
    const floatV left = LOAD(float, a + x), right = LOAD(float, b + x);
    store_float(left / right, results + x);
    store_float(sqrt(left), results + p.cases + x);
    store_float(fma(left, right, LOAD(float, c + x)), results + 2 * p.cases + x);
}
