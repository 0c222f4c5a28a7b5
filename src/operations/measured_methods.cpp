// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 0.8965518904320988, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 1.849122299382716, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 0.9029417438271605, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "uint16", "least squares", 3.35694, "corridor", 1.7536265432098765, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "fast", 0.00943386, "railings", 33.42790316358025, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "balanced", 0.00787552, "railings", 57.91039737654321, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "accurate", 0.00710104, "railings", 146.19646990740742, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "fast", 0.0419208, "mirror", 7.694396219135802, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "balanced", 0.0182889, "spheres", 24.492235725308642, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "accurate", 0.015884, "corridor", 63.109085648148145, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 8", 0.15559, "railings", 16.03954475308642, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 16", 0.0803922, "railings", 18.51345486111111, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "2 x 32", 0.0313917, "railings", 37.471305941358025, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 32", 0.0312887, "railings", 66.22685185185185, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 64", 0.0166562, "mirror", 110.06558641975309, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "fast, half resolution", 0.187275, "railings", 5.263454861111111, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "balanced, half resolution", 0.0342158, "mirror", 8.065682870370372, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "accurate, half resolution", 0.0249405, "mirror", 21.390769675925927, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0342147, "mirror", 9.939187885802468, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0330878, "mirror", 29.093074845679013, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 24", 0.0503944, "railings", 24.83719135802469, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 16, half resolution", 0.0788628, "railings", 9.115104166666667, "pthread-skylake-avx512-AMD EPYC"},
    };
    return table;
}
// clang-format on

} // namespace fathom
