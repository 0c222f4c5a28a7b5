// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 2.8648823302469135, "pthread-haswell-AMD EPYC"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 23.85257523148148, "pthread-haswell-AMD EPYC"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 2.884013310185185, "pthread-haswell-AMD EPYC"},
        {"normals", "uint16", "least squares", 3.35697, "corridor", 24.834104938271604, "pthread-haswell-AMD EPYC"},
        {"dof", "float32", "fast", 0.00935365, "railings", 142.7734375, "pthread-haswell-AMD EPYC"},
        {"dof", "float32", "balanced", 0.00729513, "railings", 187.67023533950618, "pthread-haswell-AMD EPYC"},
        {"dof", "float32", "accurate", 0.00703681, "plan", 508.71913580246917, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "fast", 0.0425344, "mirror", 23.816068672839506, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "balanced", 0.0182923, "spheres", 79.09963348765432, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "accurate", 0.0153978, "corridor", 239.20235339506172, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 8", 0.15559, "railings", 43.16237461419753, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 16", 0.0803922, "railings", 54.54812885802469, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "2 x 32", 0.0313917, "railings", 125.7542438271605, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "4 x 32", 0.0312887, "railings", 257.52893518518516, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "4 x 64", 0.0171906, "mirror", 486.5354938271605, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "fast, half resolution", 0.187275, "railings", 14.231674382716049, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "balanced, half resolution", 0.0339386, "mirror", 26.148051697530864, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "accurate, half resolution", 0.0250956, "railings", 82.78838734567901, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0339375, "mirror", 33.702980324074076, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0330446, "mirror", 111.39805169753086, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 24", 0.0503944, "railings", 77.4074074074074, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 16, half resolution", 0.0788628, "railings", 24.68653549382716, "pthread-haswell-AMD EPYC"},
    };
    return table;
}
// clang-format on

} // namespace fathom
