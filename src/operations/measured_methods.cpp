// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 0.8579861111111111, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 1.7826485339506173, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 0.8897665895061728, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "uint16", "least squares", 3.35694, "corridor", 1.7166039737654322, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "fast", 0.00935365, "railings", 31.99464699074074, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "balanced", 0.00783349, "railings", 53.10233410493827, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "accurate", 0.00707412, "railings", 124.69135802469135, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "fast", 0.0418044, "mirror", 6.761525848765432, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "balanced", 0.0182923, "spheres", 21.051842206790123, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "accurate", 0.0152496, "corridor", 59.80372299382716, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 8", 0.15559, "railings", 12.978202160493828, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 16", 0.0803922, "railings", 15.500385802469134, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "2 x 32", 0.0313917, "railings", 34.984085648148145, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 32", 0.0312887, "railings", 62.31963734567901, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 64", 0.0171906, "mirror", 106.54176311728395, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "fast, half resolution", 0.187275, "railings", 4.37548225308642, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "balanced, half resolution", 0.0339386, "mirror", 6.937065972222222, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "accurate, half resolution", 0.0249485, "mirror", 20.069782021604937, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0339375, "mirror", 8.943238811728396, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0330446, "mirror", 27.508198302469136, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 24", 0.0503944, "railings", 20.30439814814815, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 16, half resolution", 0.0788628, "railings", 6.620871913580247, "pthread-skylake-avx512-AMD EPYC"},
    };
    return table;
}
// clang-format on

} // namespace fathom
