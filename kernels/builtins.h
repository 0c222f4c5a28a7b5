// The built-in functions of OpenCL C that kernels call, declared where the host defines BUILTINS. For every program PoCL lets
// Clang read a header of 18,000 lines that declares all of them, and once more to look for the program among those that it has
// compiled: that was most of the time to load one. The host makes that header empty; see runtime/program.cpp. Functions have all
// the types here that a call could mean, so that it means the same with either header; numbers below int become int.

#ifndef FATHOM_BUILTINS_H
#define FATHOM_BUILTINS_H
#ifdef BUILTINS

#define BUILTIN __attribute__((overloadable, const))
#define N(type, n) type##n // vectors of n, or one number where n is nothing
#define EACH_VECTOR(DECLARE, ...)                                                                                      \
    DECLARE(2, __VA_ARGS__)                                                                                            \
    DECLARE(3, __VA_ARGS__) DECLARE(4, __VA_ARGS__) DECLARE(8, __VA_ARGS__) DECLARE(16, __VA_ARGS__)
#define EACH_WIDTH(DECLARE, ...) DECLARE(, __VA_ARGS__) EACH_VECTOR(DECLARE, __VA_ARGS__)

#define OF_NUMBERS(n, type, whole)                                                                                     \
    BUILTIN N(type, n) clamp(N(type, n), N(type, n), N(type, n));                                                      \
    BUILTIN N(type, n) max(N(type, n), N(type, n));                                                                    \
    BUILTIN N(type, n) min(N(type, n), N(type, n));                                                                    \
    BUILTIN N(type, n) select(N(type, n), N(type, n), N(whole, n));                                                    \
    BUILTIN N(type, n) select(N(type, n), N(type, n), N(u##whole, n));
#define WITH_ONE_NUMBER(n, type)                                                                                       \
    BUILTIN N(type, n) clamp(N(type, n), type, type);                                                                  \
    BUILTIN N(type, n) max(N(type, n), type);                                                                          \
    BUILTIN N(type, n) min(N(type, n), type);

#define OF_FLOATS(n, type)                                                                                             \
    BUILTIN N(type, n) ceil(N(type, n));                                                                               \
    BUILTIN N(type, n) exp(N(type, n));                                                                                \
    BUILTIN N(type, n) fabs(N(type, n));                                                                               \
    BUILTIN N(type, n) floor(N(type, n));                                                                              \
    BUILTIN N(type, n) fma(N(type, n), N(type, n), N(type, n));                                                        \
    BUILTIN N(type, n) fmax(N(type, n), N(type, n));                                                                   \
    BUILTIN N(type, n) fmin(N(type, n), N(type, n));                                                                   \
    BUILTIN N(type, n) mix(N(type, n), N(type, n), N(type, n));                                                        \
    BUILTIN N(type, n) sign(N(type, n));                                                                               \
    BUILTIN N(type, n) sqrt(N(type, n));
#define WITH_ONE_FLOAT(n, type)                                                                                        \
    BUILTIN N(type, n) fmax(N(type, n), type);                                                                         \
    BUILTIN N(type, n) fmin(N(type, n), type);                                                                         \
    BUILTIN N(type, n) mix(N(type, n), N(type, n), type);
#define TESTS(n, type, whole)                                                                                          \
    BUILTIN N(whole, n) isfinite(N(type, n));                                                                          \
    BUILTIN N(whole, n) isinf(N(type, n));                                                                             \
    BUILTIN N(whole, n) isnan(N(type, n));

#define OF_INTEGERS(n, type, u)                                                                                        \
    BUILTIN N(u, n) abs(N(type, n));                                                                                   \
    BUILTIN N(type, n) clz(N(type, n));                                                                                \
    BUILTIN N(type, n) popcount(N(type, n));
#define OF_SIGNED(n, type) BUILTIN int any(N(type, n));

#define CONVERT(n, to, from) BUILTIN N(to, n) convert_##to##n(N(from, n));
#define CONVERT_TO(to)                                                                                                 \
    EACH_WIDTH(CONVERT, to, char)                                                                                      \
    EACH_WIDTH(CONVERT, to, uchar)                                                                                     \
    EACH_WIDTH(CONVERT, to, short)                                                                                     \
    EACH_WIDTH(CONVERT, to, ushort)                                                                                    \
    EACH_WIDTH(CONVERT, to, int)                                                                                       \
    EACH_WIDTH(CONVERT, to, uint)                                                                                      \
    EACH_WIDTH(CONVERT, to, long)                                                                                      \
    EACH_WIDTH(CONVERT, to, ulong)                                                                                     \
    EACH_WIDTH(CONVERT, to, float)

#define FLOATS(type, whole)                                                                                            \
    EACH_WIDTH(OF_NUMBERS, type, whole)                                                                                \
    EACH_VECTOR(WITH_ONE_NUMBER, type)                                                                                 \
    EACH_WIDTH(OF_FLOATS, type)                                                                                        \
    EACH_VECTOR(WITH_ONE_FLOAT, type)                                                                                  \
    TESTS(, type, int) EACH_VECTOR(TESTS, type, whole) CONVERT_TO(type)
#define INTEGERS(type)                                                                                                 \
    EACH_WIDTH(OF_NUMBERS, type, type)                                                                                 \
    EACH_WIDTH(OF_NUMBERS, u##type, type)                                                                              \
    EACH_VECTOR(WITH_ONE_NUMBER, type)                                                                                 \
    EACH_VECTOR(WITH_ONE_NUMBER, u##type)                                                                              \
    EACH_WIDTH(OF_INTEGERS, type, u##type) EACH_WIDTH(OF_INTEGERS, u##type, u##type) EACH_WIDTH(OF_SIGNED, type)

FLOATS(float, int)
INTEGERS(int)
INTEGERS(long)
CONVERT_TO(int)
CONVERT_TO(uint)
CONVERT_TO(uchar)
CONVERT_TO(ushort)
#if FP64
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
FLOATS(double, long)
EACH_WIDTH(CONVERT, double, double)
EACH_WIDTH(CONVERT, float, double)
EACH_WIDTH(CONVERT, int, double)
EACH_WIDTH(CONVERT, uint, double)
#endif

BUILTIN size_t get_global_id(uint);
#define PURE __attribute__((overloadable, pure))
PURE float4 vload4(size_t, const __global float*);
__attribute__((overloadable)) void vstore3(float3, size_t, float*);
__attribute__((overloadable)) void vstore3(float3, size_t, __global float*);
#define OF_HALVES(n, type)                                                                                             \
    PURE N(type, n) vload_half##n(size_t, const __global half*);                                                       \
    __attribute__((overloadable)) void vstore_half##n##_rte(N(type, n), size_t, __global half*);
EACH_WIDTH(OF_HALVES, float)

#endif
#endif
