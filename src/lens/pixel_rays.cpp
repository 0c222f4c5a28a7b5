// Rays of pixels, and pixels of rays: a pinhole by its matrix, a lens by its law.

#include <fathom/pixel_rays.hpp>

#include "camera/rays.hpp"
#include "lens/camera_lens.hpp"
#include "require.hpp"

#include <Eigen/LU>

namespace fathom {

struct PixelRays::Parts {
    std::optional<lens::CameraLens> through;
    Rays::Matrix direction = Rays::Matrix::Zero(); // of a pinhole, (x, y, 1) to what lies ahead
    Rays::Matrix pixel = Rays::Matrix::Zero();     // its inverse
};

PixelRays::PixelRays(const Camera& camera) {
    auto parts = std::make_shared<Parts>();
    if (camera.lens) {
        parts->through.emplace(camera);
    } else {
        const Rays rays = camera_rays(camera);
        require(centre_rays(rays).perspective,
                "the camera is orthographic, and its rays have no centre; unproject gives positions");
        parts->direction = rays.direction;
        parts->pixel = rays.direction.inverse();
    }
    parts_ = std::move(parts);
}

std::optional<Eigen::Vector3d> PixelRays::ray_of(double x, double y) const {
    if (parts_->through)
        return parts_->through->direction(x, y);
    const Eigen::Matrix<long double, 3, 1> direction = parts_->direction * Eigen::Matrix<long double, 3, 1>(x, y, 1);
    return Eigen::Vector3d(direction.normalized().cast<double>());
}

std::optional<Eigen::Vector2d> PixelRays::pixel_of(const Eigen::Vector3d& direction) const {
    require(direction.allFinite() && !direction.isZero(0), "direction = (", direction.transpose(),
            ") must be finite, and not 0");
    if (parts_->through)
        return parts_->through->pixel(direction);
    const Eigen::Matrix<long double, 3, 1> pixel = parts_->pixel * direction.cast<long double>();
    if (!(pixel.z() > 0))
        return std::nullopt;
    return Eigen::Vector2d((pixel / pixel.z()).head<2>().cast<double>());
}

std::optional<LensFold> PixelRays::fold() const {
    return parts_->through ? parts_->through->laws().fold() : std::nullopt;
}

std::optional<Eigen::Vector3d> ray_of(const Camera& camera, double x, double y) {
    return PixelRays(camera).ray_of(x, y);
}

std::optional<Eigen::Vector2d> pixel_of(const Camera& camera, const Eigen::Vector3d& direction) {
    return PixelRays(camera).pixel_of(direction);
}

} // namespace fathom
