#pragma once

// Truth for ambient occlusion, in double: of a scene, by rays over the hemisphere, and of what one layer of depth can
// say about it, by brute force over all slices and taps.
//   V = 1/π ∫ open(ω) (n·ω) dω                        open: the ray P + l ω, 0 < l ≤ radius, meets nothing
//   a slice holds the direction V towards the camera; t is the angle from V on one of its two sides, T the side's tangent
//   ∫ (n·V cos t + n·T sin t) sin t dt = ½ [n·V sin² t + n·T (t − sin t cos t)]
// Slices are uniform in azimuth around V, so that sin t makes their sum the integral over the sphere's directions.
// Written from these equations; it shares no code with a kernel.

#include "scene/scene.hpp"

#include <fathom/camera.hpp>

#include <Eigen/Core>

#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace oracle {

inline constexpr double infinite = std::numeric_limits<double>::infinity();

/// Largest error of `visibility` with its own counts in the scenes whose visibility is known.
inline constexpr double visibility_error = 5e-5;

/// Cosine-weighted visibility of a point of the scene: rays of length `radius` over the hemisphere of `normal`, both in
/// world space. On each azimuth the changes between open and blocked are bracketed by `samples` polar angles and
/// bisected; where the result jumps from one azimuth to the next, more of them find the edge. So only what is narrower
/// than 90°/samples can be missed.
/// Accuracy: visibility_error.
double visibility(const fathom::scene::Scene& scene, const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                  double radius = infinite, int azimuths = 512, int samples = 64);

/// What a depth layer is asked.
struct ScreenOptions {
    double radius = infinite;    ///< length of the rays from the point, scene units
    double thickness = infinite; ///< what is solid behind each tap, along the tap's own ray, scene units
    int slices = 256;            ///< over half a turn; each has two sides
};

/// A depth image between whose pixels a line can be followed.
/// Along a row or column, what is affine on the screen for planes (1/z from the camera centre, z of an orthographic
/// camera) is interpolated between two pixels that the slope on either side explains, to within a pixel's width across.
/// Otherwise the line sees the nearest pixel.
class DepthLayer {
public:
    /// View depth of each pixel, row-major; anything not finite is invalid.
    DepthLayer(const fathom::Camera& camera, std::span<const double> z);
    DepthLayer(const fathom::Camera& camera, std::span<const float> z);

    int width() const { return width_; }
    int height() const { return height_; }

    /// Lines of sight, affine in the pixel position: origin + w · direction. Inverse depth is 1/w, or w for an
    /// orthographic camera.
    struct Sight {
        Eigen::Vector3d origin, origin_x, origin_y, direction, direction_x, direction_y;
        bool is_orthographic;
        double ahead; ///< view depth is ahead · z of a position

        explicit Sight(const fathom::Camera& camera);
        Eigen::Vector3d origin_at(double x, double y) const { return origin + x * origin_x + y * origin_y; }
        Eigen::Vector3d direction_at(double x, double y) const { return direction + x * direction_x + y * direction_y; }
    };
    const Sight& sight() const { return sight_; }

    /// Inverse depth of a pixel, NaN if it is invalid.
    double inverse_depth(int x, int y) const { return inverse_depth_[index(x, y)]; }

    /// Inverse depth where a line crosses the middle of column `across`, at the position `along` in rows (centres at +½).
    double between_rows(int across, double along) const;
    /// Inverse depth where a line crosses the middle of row `across`, at the position `along` in columns.
    double between_columns(int across, double along) const;

private:
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }
    double between(std::size_t start, std::size_t stride, int count, double along, double share_per_pixel) const;

    int width_, height_;
    Sight sight_;
    double share_across_, share_down_; ///< change of inverse depth, or share of it, that is as long as a pixel is wide
    std::vector<double> inverse_depth_;
};

/// Visibility as one layer of depth shows it, by brute force, with the pixel's normal: view space, the projection's own axes.
/// Each tap on a slice's line that sees a surface is a solid column from there on: along the tap's ray, `thickness`
/// long, cut to the sphere of `radius` around the point. It blocks the angles it spans. Where the columns of two
/// neighbouring taps share a range of depth (always, if infinite) so do the straight lines, cut likewise, between their
/// fronts and between their ends.
/// Taps lie in the middle of rows or columns, one pixel apart, so an edge has its place to a pixel only. What lies outside the
/// image is open. 1 where the depth is infinite; NaN where it is not a number.
double screen_visibility(const DepthLayer& layer, int x, int y, const Eigen::Vector3d& normal,
                         const ScreenOptions& options = {});

} // namespace oracle
