// Written by scripts/measured-methods from the tables that docs/make-performance measures, and not edited by hand.
// Each line: operation, storage, method, the largest error of any scene, and that scene; cheaper methods first.

#include "operations/cheapest.hpp"

namespace fathom {

// clang-format off
std::span<const Measured> measured_methods() {
    static constexpr Measured table[] = {
        {"dof", "float32", "fast", 0.00943386, "railings"},
        {"dof", "float32", "balanced", 0.00787552, "railings"},
        {"dof", "float32", "accurate", 0.00710104, "railings"},
        {"normals", "float32", "neighbours", 0.406396, "terrain"},
        {"normals", "float32", "least squares", 0.406475, "terrain"},
        {"normals", "uint16", "neighbours", 3.28087, "corridor"},
        {"normals", "uint16", "least squares", 3.35694, "corridor"},
        {"ssao", "float32", "fast, half resolution", 0.18755, "railings"},
        {"ssao", "float32", "fast", 0.0419212, "mirror"},
        {"ssao", "float32", "1 x 16, half resolution", 0.0790837, "railings"},
        {"ssao", "float32", "balanced, half resolution", 0.0341924, "mirror"},
        {"ssao", "float32", "1 x 64, half resolution", 0.0341914, "mirror"},
        {"ssao", "float32", "1 x 8", 0.155505, "railings"},
        {"ssao", "float32", "1 x 16", 0.0802876, "railings"},
        {"ssao", "float32", "accurate, half resolution", 0.0249417, "mirror"},
        {"ssao", "float32", "1 x 24", 0.0502409, "railings"},
        {"ssao", "float32", "balanced", 0.0178837, "spheres"},
        {"ssao", "float32", "4 x 64, half resolution", 0.0331031, "mirror"},
        {"ssao", "float32", "2 x 32", 0.0312955, "railings"},
        {"ssao", "float32", "accurate", 0.015884, "corridor"},
        {"ssao", "float32", "4 x 32", 0.0312792, "railings"},
        {"ssao", "float32", "4 x 64", 0.0166573, "mirror"},
    };
    return table;
}
// clang-format on

} // namespace fathom
