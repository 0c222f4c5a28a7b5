// Rays from view space to the world: position = view⁻¹ (origin + w direction).

#include "camera/world_rays.hpp"

#include "camera/matrix.hpp"
#include "text.hpp"

#include <stdexcept>

namespace fathom {

Rays rays_in_world(const Rays& rays, const Eigen::Matrix4d& view, const Eigen::Vector3d& origin) {
    if (!view.allFinite() || view.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
        throw std::invalid_argument("the view matrix must be finite with a fourth row of 0 0 0 1");
    }
    if (!origin.allFinite())
        throw std::invalid_argument(text("origin = (", origin.transpose(), ") must be finite"));
    const auto inverse = checked_inverse(view.cast<long double>(), "the view matrix");
    Rays world = rays;
    world.direction = inverse.topLeftCorner<3, 3>() * rays.direction;
    world.origin = inverse.topLeftCorner<3, 3>() * rays.origin;
    world.origin.col(2) += inverse.topRightCorner<3, 1>() - origin.cast<long double>();
    return world;
}

} // namespace fathom
