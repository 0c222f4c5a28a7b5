#pragma once

#include <fathom/camera.hpp>

namespace fathom {

/// The same rays seen from the world, positions relative to `origin`.
/// Throws: std::invalid_argument when the view matrix is not an invertible affine map.
Rays rays_in_world(const Rays& rays, const Eigen::Matrix4d& view, const Eigen::Vector3d& origin);

} // namespace fathom
