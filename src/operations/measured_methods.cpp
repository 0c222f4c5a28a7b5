// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 1.4094039351851853, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 8.89014274691358, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 1.4108555169753085, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"normals", "uint16", "least squares", 3.35697, "corridor", 8.875048225308642, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "fast", 0.00935365, "railings", 41.349006558641975, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "balanced", 0.00941079, "railings", 60.306230709876544, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"dof", "float32", "accurate", 0.00703681, "plan", 256.3869598765432, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "fast", 0.042537, "mirror", 9.358699845679013, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "balanced", 0.0182923, "spheres", 34.47757523148148, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "accurate", 0.0153978, "corridor", 71.51572145061728, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 8", 0.15559, "railings", 19.02536651234568, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 16", 0.0803922, "railings", 22.850067515432098, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "2 x 32", 0.0313917, "railings", 58.65403163580247, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 32", 0.0312887, "railings", 109.45408950617283, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 64", 0.0171906, "mirror", 198.46547067901236, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "fast, half resolution", 0.187275, "railings", 6.689236111111111, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "balanced, half resolution", 0.0339386, "mirror", 11.058545524691358, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "accurate, half resolution", 0.0250956, "railings", 30.384886188271604, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0339375, "mirror", 14.980034722222221, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0330446, "mirror", 48.760609567901234, "pthread-skylake-avx512-Intel(R) Xeon(R) Processor"},
        {"ssao", "float32", "1 x 24", 0.0503944, "railings", 150.7368827160494, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 16, half resolution", 0.0788628, "railings", 48.38155864197531, "pthread-haswell-AMD EPYC"},
    };
    return table;
}
// clang-format on

} // namespace fathom
