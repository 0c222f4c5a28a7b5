// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 0.8730758101851852, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 1.8061149691358025, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 0.9085503472222223, "pthread-skylake-avx512-AMD EPYC"},
        {"normals", "uint16", "least squares", 3.35694, "corridor", 1.735836226851852, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "fast", 0.00935365, "railings", 51.54417438271605, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "balanced", 0.00783349, "railings", 76.58564814814815, "pthread-skylake-avx512-AMD EPYC"},
        {"dof", "float32", "accurate", 0.00707412, "railings", 198.1370563271605, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "fast", 0.0418044, "mirror", 7.4623842592592595, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "balanced", 0.0182923, "spheres", 21.861400462962962, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "accurate", 0.0152496, "corridor", 61.33198302469136, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 8", 0.15559, "railings", 14.026813271604938, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 16", 0.0803922, "railings", 16.242766203703702, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "2 x 32", 0.0313917, "railings", 36.75559413580247, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 32", 0.0312887, "railings", 66.69560185185185, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 64", 0.0171906, "mirror", 114.23369984567901, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "fast, half resolution", 0.187275, "railings", 4.837143132716049, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "balanced, half resolution", 0.0339386, "mirror", 7.364486882716049, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "accurate, half resolution", 0.0249485, "mirror", 21.68262924382716, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0339375, "mirror", 9.487991898148149, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0330446, "mirror", 30.152536651234566, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 24", 0.0503944, "railings", 21.45505401234568, "pthread-skylake-avx512-AMD EPYC"},
        {"ssao", "float32", "1 x 16, half resolution", 0.0788628, "railings", 7.0987075617283955, "pthread-skylake-avx512-AMD EPYC"},
    };
    return table;
}
// clang-format on

} // namespace fathom
