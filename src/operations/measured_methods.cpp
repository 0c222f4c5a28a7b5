// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 1.3855902777777778, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 8.894338348765432, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 1.38804012345679, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "uint16", "least squares", 3.35697, "corridor", 8.873505015432098, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "fast", 0.00962638, "railings", 41.92124807098765, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "balanced", 0.00953714, "railings", 68.10378086419753, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "accurate", 0.00706036, "plan", 300.59124228395063, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "fast", 0.185375, "railings", 17.353105709876544, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "balanced", 0.032448, "railings", 33.9389949845679, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "accurate", 0.0338788, "railings", 107.81780478395062, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 8", 0.155609, "railings", 18.51461226851852, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 16", 0.080427, "railings", 23.307966820987655, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "2 x 32", 0.0314735, "railings", 61.458333333333336, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 32", 0.0312931, "railings", 114.70727237654322, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 64", 0.0153162, "mirror", 209.58863811728395, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "fast, half resolution", 0.190038, "railings", 6.702498070987654, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "balanced, half resolution", 0.0361632, "mirror", 11.798466435185185, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "accurate, half resolution", 0.0341438, "railings", 32.62683256172839, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 16, half resolution", 0.079926, "railings", 8.664978780864198, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0361619, "mirror", 15.869068287037038, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0352533, "mirror", 52.01581790123457, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
    };
    return table;
}
// clang-format on

} // namespace fathom
