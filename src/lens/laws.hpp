#pragma once

#include "lens/ray_map.hpp"
#include "lens/solve.hpp"

#include <limits>
#include <optional>

namespace fathom::lens {

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
