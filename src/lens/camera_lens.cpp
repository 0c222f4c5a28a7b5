// A lens in its camera: u = (x − cx)/fx to the right, v = (y − cy)/fy downwards on the screen. And rays of pixels and pixels of rays of
// any camera, with a lens or without.

#include "lens/camera_lens.hpp"

#include "camera/rays.hpp"
#include "require.hpp"

#include <fathom/pixel_rays.hpp>

#include <Eigen/LU>

#include <cmath>
#include <iomanip>
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
    if (model_.map)
        require(model_.cx <= 0 && model_.cy <= 0 && camera.width - model_.cx <= model_.map->width &&
                    camera.height - model_.cy <= model_.map->height,
                "the map of rays has ", model_.map->width, " x ", model_.map->height, " pixels, the camera ",
                camera.width, " x ", camera.height);
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

std::optional<Eigen::Vector3d> CameraLens::direction(double x, double y) const {
    const auto ray = laws_.ray((x - model_.cx) / model_.fx, (first_ + down_ * y - model_.cy) / model_.fy);
    if (!ray)
        return std::nullopt;
    const auto& [a, b, c] = *ray;
    return to_view_.cwiseProduct(Eigen::Vector3d(a.value, b.value, c.value));
}

double CameraLens::part_beyond_fold(int width, int height) const {
    const auto& fold = laws_.fold();
    // A distorted pinhole has no other pixels without rays: its tangential part and its thin prism fold, too.
    if (law() != LensLaw::brown && (!fold || fold->angle >= std::numbers::pi / 2))
        return 0;
    constexpr int across = 64; // places in a row and in a column
    int beyond = 0;
    for (int y = 0; y < across; ++y)
        for (int x = 0; x < across; ++x)
            beyond += !direction((x + 0.5) * width / across, (y + 0.5) * height / across);
    return static_cast<double>(beyond) / (across * across);
}

void CameraLens::require_unfolded(int width, int height) const {
    const double beyond = part_beyond_fold(width, height);
    if (!(beyond > 0.5))
        return;
    require(false, "the lens ", to_string(law()), " ", fold_words(), ", and ", static_cast<int>(100 * beyond),
            " % of the image lie beyond; calibrate with points in its corners, or give the part that they surround");
}

std::string CameraLens::fold_words() const {
    if (const auto& fold = laws_.fold())
        return text(std::setprecision(3), "folds ", fold->angle * 180 / std::numbers::pi,
                    " degrees from its axis, at a radius of ", fold->radius, " focal lengths, where ",
                    fold->coefficient, " bends it most");
    return "folds where p1, p2 or s1 to s4 bend it";
}

Eigen::Vector2d CameraLens::pixel_on_axis() const {
    const double x = model_.map ? model_.map->width / 2 + 0.5 : 0, y = model_.map ? model_.map->height / 2 + 0.5 : 0;
    const auto found = laws_.ray(Jet(x, 1 / model_.fx, 0, 0), Jet(y, 0, 1 / model_.fy, 0));
    require(found.has_value(),
            "the map of rays has no ray in its middle, which gives a circle of confusion its pixels");
    const RayJets& ray = *found;
    return {std::hypot(ray[0].x, ray[1].x, ray[2].x), std::hypot(ray[0].y, ray[1].y, ray[2].y)};
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

namespace fathom {

// A pinhole has rays by its matrix, a lens by its law.
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
