#pragma once

#include <fathom/camera.hpp>

#include <memory>

namespace fathom {
#pragma GCC visibility push(default)

/// The rays of a camera's pixels, for single points, on the host: of a pinhole, or through a lens.
///
/// `pixel_of(ray_of(x, y))` is within `pixel_rays_round_trip_px` of (x, y) wherever there is a ray. Of a map of rays it may be none,
/// or another pixel of all but the same ray, beside a fold and straight behind, where the rays of many pixels nearly meet.
/// Throws where it is made: std::invalid_argument for a lens whose numbers cannot be, and for an orthographic camera.
/// Source: OpenCV, calib3d and fisheye; Usenko, Demmel, Cremers 2018 (double sphere); Cycles, kernel/camera/projection.h.
class PixelRays {
public:
    explicit PixelRays(const Camera& camera);

    /// The unit vector from the camera centre through a pixel position, counted from the corner of the first stored pixel, in the
    /// axes of the camera's view space. None where no ray meets the pixel: beyond a fold, or outside a fisheye's circle.
    std::optional<Eigen::Vector3d> ray_of(double x, double y) const;

    /// The pixel position in which the camera sees what lies there: any vector from the camera centre but 0. None where it sees
    /// nothing. A position may lie outside the image.
    std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector3d& direction) const;

    /// Where a lens folds; none where it does not.
    std::optional<LensFold> fold() const;

private:
    struct Parts;
    std::shared_ptr<const Parts> parts_;
};

inline constexpr double pixel_rays_round_trip_px = 1e-9;

/// The same for one point. Whoever asks for many makes the `PixelRays` once.
std::optional<Eigen::Vector3d> ray_of(const Camera& camera, double x, double y);
std::optional<Eigen::Vector2d> pixel_of(const Camera& camera, const Eigen::Vector3d& direction);

#pragma GCC visibility pop
} // namespace fathom
