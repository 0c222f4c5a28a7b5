#pragma once

#include "lens/solve.hpp"

#include <fathom/lens_model.hpp>

#include <Eigen/Core>

#include <array>
#include <limits>
#include <optional>
#include <vector>

namespace fathom::lens {

/// A ray with its derivatives by pixels: X right, Y down, Z ahead.
using RayJets = std::array<Jet, 3>;

/// The ray of a map at a position from the corner of its first pixel: of the four pixels around it, where all of them have one. In a
/// pixel's centre it is the pixel's own.
std::optional<RayJets> mapped_ray(const RayMap& map, const Jet& x, const Jet& y);

/// Where a map sees unit vectors. It knows some of the map's rays, and finds the nearest pixel from the nearest of those.
class MapPixels {
public:
    MapPixels() = default;
    explicit MapPixels(const RayMap& map);

    /// Beside the pixel of the same map whose ray is the nearest one, at most a pixel away from its centre.
    std::optional<Eigen::Vector2d> at(const RayMap& map, const Eigen::Vector3d& direction) const;

private:
    struct Pixel {
        Eigen::Vector2i at;
        Eigen::Vector3d ray;
    };
    std::vector<Pixel> some_; ///< one in each square of so many pixels
    int step_ = 1;
};

/// The rays of a lens, in units of its focal lengths. Checked where it is made.
class Laws {
public:
    explicit Laws(const LensModel& model);

    /// The unit ray through (u, v), which are jets of the pixel's position; none where there is no ray.
    std::optional<RayJets> ray(const Jet& u, const Jet& v) const;

    /// (u, v) of a direction; none where the lens sees nothing.
    std::optional<Eigen::Vector2d> image(const Eigen::Vector3d& direction) const;

    const std::optional<LensFold>& fold() const { return fold_; }

private:
    /// The curve that a law is made of: r of the tangent for a distorted pinhole, r of θ for a fisheye, θ of r for Blender's.
    Jet curve(const Jet& at) const;
    auto curve() const {
        return [this](const Jet& at) { return curve(at); };
    }
    bool only_radial() const;
    double find_end();
    std::optional<Two<double>> undistorted(const Two<double>& image) const;
    double find_farthest() const;

    LensModel model_;
    MapPixels map_pixels_;
    Rise rise_; ///< of the curve, at most to where it folds, or to its last angle
    std::optional<LensFold> fold_;
    double farthest_ =
        std::numeric_limits<double>::infinity(); ///< radius in the image of a distorted pinhole that has a ray
};

} // namespace fathom::lens
