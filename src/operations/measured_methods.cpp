// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, that scene, ns per pixel, the device.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"normals", "float32", "neighbours", 0.406396, "terrain", 2.7333670910493826, "pthread-haswell-AMD EPYC"},
        {"normals", "float32", "least squares", 0.406475, "terrain", 21.410108024691358, "pthread-haswell-AMD EPYC"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor", 2.7601707175925925, "pthread-haswell-AMD EPYC"},
        {"normals", "uint16", "least squares", 3.35697, "corridor", 22.43113425925926, "pthread-haswell-AMD EPYC"},
        {"dof", "float32", "fast", 0.00935365, "railings", 82.48119212962963, "pthread-haswell-AMD EPYC"},
        {"dof", "float32", "balanced", 0.00941079, "railings", 116.7018711419753, "pthread-haswell-AMD EPYC"},
        {"dof", "float32", "accurate", 0.00703681, "plan", 554.4849537037037, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "fast", 0.0425344, "mirror", 21.538724922839506, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "balanced", 0.0182923, "spheres", 76.52536651234568, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "accurate", 0.0153978, "corridor", 268.24749228395063, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 8", 0.15559, "railings", 36.85223765432099, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 16", 0.0803922, "railings", 51.31028163580247, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "2 x 32", 0.0313917, "railings", 123.32851080246914, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "4 x 32", 0.0312887, "railings", 234.92091049382717, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "4 x 64", 0.0171906, "mirror", 476.68836805555554, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "fast, half resolution", 0.187275, "railings", 14.384403935185185, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "balanced, half resolution", 0.0339386, "mirror", 23.70360725308642, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "accurate, half resolution", 0.0250956, "railings", 79.51388888888889, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0339375, "mirror", 31.571228780864196, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0330446, "mirror", 111.94251543209876, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 24", 0.0503944, "railings", 80.84297839506173, "pthread-haswell-AMD EPYC"},
        {"ssao", "float32", "1 x 16, half resolution", 0.0788628, "railings", 25.57465277777778, "pthread-haswell-AMD EPYC"},
    };
    return table;
}
// clang-format on

} // namespace fathom
