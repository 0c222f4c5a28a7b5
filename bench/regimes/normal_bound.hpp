#pragma once

// What `normals_slope_error` and the bound of stored depth's error do to a plane's normal.

#include "camera/rays.hpp"
#include "operations/inverse_depth.hpp"

#include <fathom/fathom.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fathom::regimes {

/// n = gx Dy x d + gy d x Dx + q Dx x Dy moves by no more than the sum of the three, with slopes that are off by
/// `normals_slope_error` times the bound of inverse depth's error and a depth that is off by that bound.
class NormalBound {
public:
    explicit NormalBound(const Camera& camera, Storage storage = Storage::float32, double tolerance = 1)
        : rays_(centre_rays(camera_rays(camera))), error_(inverse_depth_error(camera, storage)), tolerance_(tolerance),
          direction_(rays_.direction.cast<double>()),
          moving_(rays_.perspective ? direction_ : Eigen::Matrix3d(rays_.origin.cast<double>())),
          of_q_(moving_.col(0).cross(moving_.col(1))) {}

    double degrees(int x, int y, double z, const Eigen::Vector3d& normal) const {
        const Eigen::Vector3d pixel(x + 0.5, y + 0.5, 1);
        const Eigen::Vector3d d =
            rays_.perspective ? Eigen::Vector3d(direction_ * pixel) : Eigen::Vector3d(direction_.col(2));
        const Eigen::Vector3d of_x = moving_.col(1).cross(d), of_y = d.cross(moving_.col(0));
        const double covered = rays_.depth.cast<double>().dot(pixel);
        const double q = rays_.perspective ? covered / (z - static_cast<double>(rays_.centre_depth)) : -z;
        const double size = std::abs(q),
                     off = tolerance_ *
                           (static_cast<double>(error_.constant) +
                            (static_cast<double>(error_.linear) + static_cast<double>(error_.quadratic) * size) * size);
        // n.d is q, or 1, times the volume of the three; the kernel's own arithmetic is a few roundings of all that.
        const double length = std::abs((rays_.perspective ? q : 1) * of_q_.dot(d) / normal.dot(d));
        const double moved = normals_slope_error * off * (of_x.norm() + of_y.norm()) +
                             (rays_.perspective ? off * of_q_.norm() : 0) + 16 * 0x1p-24 * length;
        return std::asin(std::min(1.0, moved / length)) * 180 / std::numbers::pi;
    }

private:
    CentreRays rays_;
    InverseDepthError error_;
    double tolerance_;
    Eigen::Matrix3d direction_, moving_;
    Eigen::Vector3d of_q_;
};

} // namespace fathom::regimes
