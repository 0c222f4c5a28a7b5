// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 1.4272569444444445, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 8.967640817901234, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 1.4256462191358024, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "uint16", "least squares", 3.35697, "corridor", 8.949556327160494, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "fast", 0.009615, "railings", 109.40538194444444, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "balanced", 0.00962603, "railings", 117.2926311728395, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "accurate", 0.00706036, "plan", 1472.193287037037, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "fast", 0.185375, "railings", 20.645929783950617, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "balanced", 0.032448, "railings", 39.18161651234568, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "accurate", 0.0338788, "railings", 121.81954089506173, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 8", 0.155609, "railings", 21.82224151234568, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 16", 0.080427, "railings", 27.020206404320987, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "2 x 32", 0.0314735, "railings", 71.51909722222223, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 32", 0.0312931, "railings", 130.27536651234567, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 64", 0.0153162, "mirror", 238.45727237654322, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "fast, half resolution", 0.190038, "railings", 7.492814429012346, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "balanced, half resolution", 0.0361632, "mirror", 13.033757716049383, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "accurate, half resolution", 0.0341438, "railings", 36.175925925925924, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 16, half resolution", 0.079926, "railings", 9.653211805555555, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0361619, "mirror", 18.00829475308642, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0352533, "mirror", 59.584780092592595, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
    };
    return table;
}
// clang-format on

} // namespace fathom
