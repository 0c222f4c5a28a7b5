#pragma once

#include <fathom/camera.hpp>

namespace fathom {

/// The camera's rays counted from where they start: position = origin(x, y) + w direction(x, y) with
/// w = (z − centre_depth) / depth(x, y). Under a perspective `origin` is the camera centre for every pixel, otherwise
/// `direction` is the same for every pixel.
///
/// Planes are affine on the screen in q = 1/w of a perspective and in q = −w otherwise: their *inverse depth*, which is
/// greater the nearer a surface is.
struct CentreRays {
    bool perspective;
    Rays::Matrix origin;
    Rays::Matrix direction;
    Eigen::Matrix<long double, 1, 3> depth;
    long double centre_depth;
};

/// The rays of `camera_rays`, counted from the camera centre.
CentreRays centre_rays(const Rays& rays);

/// The axes of view space, as if they were the three columns of rays from the camera centre: what takes them elsewhere takes a lens's
/// rays there.
Rays axes_of_view();

/// The same rays seen from the world, positions relative to `origin`.
/// Throws: std::invalid_argument when the view matrix is not an invertible affine map.
Rays rays_in_world(const Rays& rays, const Eigen::Matrix4d& view, const Eigen::Vector3d& origin);

/// Bound of the error of inverse depth q that storing depth caused: constant + linear |q| + quadratic q².
struct InverseDepthError {
    float constant, linear, quadratic;
};

/// Half a step of what the depth was stored in, carried over to q by |dq/dv|, and the roundings of q itself. The step is
/// that of the storage, or of the buffer of `camera.depth_bits` that a float image came from. To first order in the step;
/// what depends on the pixel is taken at its worst.
InverseDepthError inverse_depth_error(const Camera& camera, Storage storage);

} // namespace fathom
