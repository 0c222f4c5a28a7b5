// What the device makes of quotients, square roots and fused products, V cases per work-item. A compiler that may round
// otherwise likes to multiply by a reciprocal where two quotients share their divisor, or where it is a constant. It also
// likes to round a product and a sum once, and to leave out a sum with 0, which turns -0 into 0.
// The host knows the right results: src/runtime/probe.cpp.

#include "vector.h"

KERNEL void arithmetic(__global const float* a, __global const float* b, __global const float* c, __global float* results,
                         const probe_params p) {
    const uint x = (uint)get_global_id(0) * V;
    if (x >= p.cases)
        return;
    const floatV left = LOAD(float, a + x), right = LOAD(float, b + x), third = LOAD(float, c + x);
    store_float(left / right, results + x);
    store_float(sqrt(left), results + p.cases + x);
    store_float(fma(left, right, third), results + 2 * p.cases + x);
    store_float(third / right, results + 3 * p.cases + x);
    store_float(left / (float)probe_divisor, results + 4 * p.cases + x);
    store_float(left * right + third, results + 5 * p.cases + x);
    store_float(third + 0.0f, results + 6 * p.cases + x);
}
