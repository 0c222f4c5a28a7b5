// A lens in its camera: u = (x − cx)/fx to the right, v = (y − cy)/fy downwards on the screen.

#include "lens/camera_lens.hpp"

#include "require.hpp"

#include <cmath>
#include <numbers>

namespace fathom::lens {

CameraLens::CameraLens(const Camera& camera) : model_(*camera.lens), laws_(model_), width_(camera.width) {
    require(camera.width > 0 && camera.height > 0, "a camera for ", camera.width, " x ", camera.height,
            " pixels: both must be at least 1");
    const ViewAxes axes = camera.projection.convention.view_axes;
    to_view_ = {1, axes == ViewAxes::opencv ? 1.0 : -1.0, axes == ViewAxes::opengl ? -1.0 : 1.0};
    if (camera.rows == Rows::bottom_up) {
        down_ = -1;
        first_ = camera.height;
    }
    if (model_.law == LensLaw::equirectangular)
        turn_ = 2 * std::numbers::pi * model_.fx;
}

std::optional<RayJets> CameraLens::ray(double x, double y) const {
    const Jet u((x - model_.cx) / model_.fx, 1 / model_.fx, 0, 0);
    const Jet v((first_ + down_ * y - model_.cy) / model_.fy, 0, down_ / model_.fy, 0);
    auto ray = laws_.ray(u, v);
    for (std::size_t i = 0; ray && i < 3; ++i)
        (*ray)[i] = (*ray)[i] * to_view_[static_cast<Eigen::Index>(i)];
    return ray;
}

std::optional<Eigen::Vector2d> CameraLens::pixel(const Eigen::Vector3d& direction) const {
    const auto image = laws_.image(to_view_.cwiseProduct(direction));
    if (!image)
        return std::nullopt;
    double x = model_.cx + model_.fx * image->x();
    if (turn_ > 0 && (x < 0 || x >= width_)) { // a panorama may begin at any longitude
        const double within = x - turn_ * std::floor(x / turn_);
        x = within < width_ ? within : x;
    }
    return Eigen::Vector2d(x, down_ * (model_.cy + model_.fy * image->y() - first_));
}

} // namespace fathom::lens
