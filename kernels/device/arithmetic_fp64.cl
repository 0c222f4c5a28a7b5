// The same as arithmetic.cl in double, one case per work-item. Numbers are their bits, the low word first.

#include "vector.h"

#if FP64
INLINE double number_at(__global const uint* words, uint x) {
    return as_double((ulong)words[2 * x + 1] << 32 | words[2 * x]);
}

INLINE void put_number(__global uint* words, uint x, double value) {
    const ulong bits = as_ulong(value);
    words[2 * x] = (uint)bits;
    words[2 * x + 1] = (uint)(bits >> 32);
}
#endif

KERNEL void arithmetic_fp64(__global const uint* a, __global const uint* b, __global const uint* c, __global uint* results,
                              const probe_params p) {
#if FP64
    const uint x = get_global_id(0);
    if (x >= p.cases)
        return;
    const double left = number_at(a, x), right = number_at(b, x), third = number_at(c, x);
    put_number(results, x, left / right);
    put_number(results, p.cases + x, sqrt(left));
    put_number(results, 2 * p.cases + x, fma(left, right, third));
    put_number(results, 3 * p.cases + x, third / right);
    put_number(results, 4 * p.cases + x, left / (double)probe_divisor);
    put_number(results, 5 * p.cases + x, left * right + third);
    put_number(results, 6 * p.cases + x, third + 0.0);
#endif
}
