#pragma once

// Truth for ambient occlusion, in double: of a scene, by rays over the hemisphere, and of what one layer of depth can
// say about it, by brute force over all slices and taps.
//   V = 1/π ∫ open(ω) (n·ω) dω                        open: the ray P + l ω, 0 < l ≤ radius, meets nothing
//   a slice holds the direction V towards the eye; t is the angle from V on one of its two sides, T the side's tangent
//   ∫ (n·V cos t + n·T sin t) sin t dt = ½ [n·V sin² t + n·T (t − sin t cos t)]
// Slices are uniform in azimuth around V, so that sin t makes their sum the integral over the sphere's directions.
// Written from these equations; it shares no code with a kernel.

#include "scene/scene.hpp"

#include <fathom/camera.hpp>

#include <Eigen/Core>

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace oracle {

inline constexpr double endless = std::numeric_limits<double>::infinity();

/// Cosine-weighted visibility of a point of the scene: rays of length `radius` over the hemisphere of `normal`, both in
/// world space. For each azimuth the changes between open and blocked are bracketed by `samples` polar angles and
/// bisected, so only what is narrower than 90°/samples can be missed.
double visibility(const fathom::scene::Scene& scene, const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                  double radius = endless, int azimuths = 1024, int samples = 64);

/// What a depth layer is asked.
struct ScreenOptions {
    double radius = endless;    ///< length of the rays from the point, scene units
    double thickness = endless; ///< what is solid behind each tap, along the tap's own ray, scene units
    int slices = 256;           ///< over half a turn; each has two sides
    double step_px = 0.5;       ///< between taps; a depth image is stepped from one row or column to the next instead
};

/// Visibility as one layer of depth shows it, by brute force.
/// Each tap on a slice's line that sees a surface is a solid column from there on: along the tap's ray, `thickness`
/// long, cut to the ball of `radius` around the point. It blocks the angles it spans. So does the straight line between
/// the fronts of two neighbouring taps, cut likewise, where their columns share a range of depth (always, if endless).
/// What lies outside the image, or before the near plane, is open. 1 where the pixel sees nothing.
/// The normal is the surface's own, or the one given: view space, the projection's own axes.
double screen_visibility(const fathom::scene::Caster& caster, int x, int y, const ScreenOptions& options = {},
                         const std::optional<Eigen::Vector3d>& normal = std::nullopt);

/// The same for one pixel of a camera.
double screen_visibility(const fathom::scene::Scene& scene, const fathom::Camera& camera, int x, int y,
                         const ScreenOptions& options = {},
                         const std::optional<Eigen::Vector3d>& normal = std::nullopt);

/// A depth image between whose pixels a line can be followed.
/// Along a row or column, what is affine on the screen for planes (1/z from the eye, z of parallel rays) is interpolated
/// between two pixels that the slope on either side explains, to within a pixel's width across. Otherwise the line sees
/// the nearest pixel.
class DepthLayer {
public:
    /// View depth of each pixel, row-major; anything not finite is no surface.
    DepthLayer(const fathom::Camera& camera, std::span<const double> z);
    DepthLayer(const fathom::Camera& camera, std::span<const float> z);

    int width() const { return width_; }
    int height() const { return height_; }

    /// Lines of sight, affine in the pixel position: origin + w · direction. Planar is 1/w, or w of parallel rays.
    struct Sight {
        Eigen::Vector3d origin, origin_x, origin_y, direction, direction_x, direction_y;
        bool parallel;
        double ahead; ///< view depth is ahead · z of a position

        explicit Sight(const fathom::Camera& camera);
        Eigen::Vector3d origin_at(double x, double y) const { return origin + x * origin_x + y * origin_y; }
        Eigen::Vector3d direction_at(double x, double y) const { return direction + x * direction_x + y * direction_y; }
    };
    const Sight& sight() const { return sight_; }

    /// Planar depth of a pixel, NaN where there is no surface.
    double planar(int x, int y) const { return planar_[index(x, y)]; }

    /// Planar depth where a line crosses the middle of column `across`, at the position `along` in rows (centres at +½).
    double between_rows(int across, double along) const;
    /// Planar depth where a line crosses the middle of row `across`, at the position `along` in columns.
    double between_columns(int across, double along) const;

private:
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }
    double between(std::size_t start, std::size_t stride, int count, double along, double share_per_pixel) const;

    int width_, height_;
    Sight sight_;
    double share_across_, share_down_; ///< change of planar depth, or share of it, that is as long as a pixel is wide
    std::vector<double> planar_;
};

/// As above, of a depth image, with the pixel's normal. NaN where the pixel is no surface but for an infinite depth: 1.
double screen_visibility(const DepthLayer& layer, int x, int y, const Eigen::Vector3d& normal,
                         const ScreenOptions& options = {});

} // namespace oracle
