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

inline constexpr double infinite = std::numeric_limits<double>::infinity();

/// Largest error of `visibility` with its own counts in the scenes whose visibility is known below.
inline constexpr double visibility_error = 5e-5;

/// Largest difference between `visibility` and `screen_visibility` of height fields, for points whose sphere the image
/// shows whole. `visibility_error` is a part of it.
inline constexpr double screen_error = 2e-4;

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
    int slices = 256;            ///< over half a turn; each has two sides. A scene gets more where the result jumps
    double step_px = 0.5;        ///< between taps; a depth image is stepped from one row or column to the next instead
};

/// Visibility as one layer of depth shows it, by brute force.
/// Each tap on a slice's line that sees a surface is a solid column from there on: along the tap's ray, `thickness`
/// long, cut to the sphere of `radius` around the point. It blocks the angles it spans. Where the columns of two
/// neighbouring taps share a range of depth (always, if infinite) so do the straight lines, cut likewise, between their
/// fronts and between their ends.
/// Where a plane does not explain what two neighbouring taps see, more taps find the edge to 1/1000 of a step; what lies
/// between two taps that see the same plane is missed.
/// What lies outside the image, or before the near plane, is open. 1 where the pixel sees nothing.
/// The normal is the surface's own, or the one given: view space, the projection's own axes.
/// Accuracy: screen_error. Walls that are seen edge-on at their very rim (a hemisphere from straight above) have ten
/// times that; so have things with corners under a finite thickness, in proportion to the step.
double screen_visibility(const fathom::scene::Caster& caster, int x, int y, const ScreenOptions& options = {},
                         const std::optional<Eigen::Vector3d>& normal = std::nullopt);

/// The same for one pixel of a camera.
double screen_visibility(const fathom::scene::Scene& scene, const fathom::Camera& camera, int x, int y,
                         const ScreenOptions& options = {},
                         const std::optional<Eigen::Vector3d>& normal = std::nullopt);

/// A depth image between whose pixels a line can be followed.
/// Along a row or column, what is affine on the screen for planes (1/z from the eye, z of an orthographic camera) is interpolated
/// between two pixels that the slope on either side explains, to within a pixel's width across. Otherwise the line sees
/// the nearest pixel.
class DepthLayer {
public:
    /// View depth of each pixel, row-major; anything not finite is no surface.
    DepthLayer(const fathom::Camera& camera, std::span<const double> z);
    DepthLayer(const fathom::Camera& camera, std::span<const float> z);

    int width() const { return width_; }
    int height() const { return height_; }

    /// Lines of sight, affine in the pixel position: origin + w · direction. Planar is 1/w, or w of an orthographic camera.
    struct Sight {
        Eigen::Vector3d origin, origin_x, origin_y, direction, direction_x, direction_y;
        bool is_orthographic;
        double ahead; ///< view depth is ahead · z of a position

        explicit Sight(const fathom::Camera& camera);
        Eigen::Vector3d origin_at(double x, double y) const { return origin + x * origin_x + y * origin_y; }
        Eigen::Vector3d direction_at(double x, double y) const { return direction + x * direction_x + y * direction_y; }
    };
    const Sight& sight() const { return sight_; }

    /// Inverse depth of a pixel, NaN where there is no surface.
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

/// As above, of a depth image, with the pixel's normal: view space, the projection's own axes. Taps lie in the middle of
/// rows or columns, one pixel apart, so an edge has its place to a pixel only.
/// 1 where the depth is infinite; NaN where it is not a number.
double screen_visibility(const DepthLayer& layer, int x, int y, const Eigen::Vector3d& normal,
                         const ScreenOptions& options = {});

/// A scene and what is known about it: the visibility of one point, for rays of one length.
/// The point lies on the plane z = 0 and in the world's origin, unless its function says otherwise.
struct Known {
    fathom::scene::Scene scene;
    double visibility;
    double radius = infinite;
    Eigen::Vector3d from{0, 0, 1}; ///< where an eye sees all that blocks: the scene is a height field from there
    Eigen::Vector3d position{0, 0, 0}, normal{0, 0, 1};
};

/// V = 1. The plane through the origin, its normal turned by `tilt` from +z towards the azimuth `towards`.
Known open_plane(double tilt, double towards = 0);
/// V = ½(1 − cos α). The second plane leaves z = 0 at x = `distance` with the interior angle α.
Known crease(double alpha, double distance = 1);
/// V = ¼. Walls at x = `distance_x` and y = `distance_y`.
Known corner(double distance_x = 1, double distance_y = 1);
/// V = 1 − ½(1 − d/√(d² + h²)). A wall of this height at x = `distance`, infinite along y.
Known wall(double height, double distance);
/// V = 1 − (θ − sin θ cos θ)/π, cos θ = d/R: an infinite wall at x = `distance` and rays of length `radius`.
Known infinite_wall(double distance, double radius);
/// V = ½(sin θ₂ − sin θ₁). Walls of two heights to the left and to the right, infinite along y.
Known trench(double left, double left_height, double right, double right_height);
/// V = 1 − h/(2 r), everywhere. The bowl's lowest point is the origin; the point lies `polar` up along its curve.
Known bowl(double radius, double depth, double polar = 0);
/// V = cos² e. A round pit, in whose middle the horizon is up at `elevation`, at most 45°, on all sides.
Known uniform_horizon(double elevation);
/// V = 1 − (1 + ρ²/r²)^(−3/2). A sphere rests on the plane at the distance ρ. No height field.
Known resting_sphere(double radius, double distance);
/// V = ½(1 + (ρ² + h² − a²)/√((ρ² + h² + a²)² − 4 a² ρ²)), for ρ = 0: h²/(a² + h²). A disk of radius a, its centre
/// at a height h and ρ to the side. No height field.
Known floating_disk(double radius, double height, double aside = 0);

/// Where cameras stand: `distance` from the target, in the direction `from`. The image shows `extent` across there.
struct Placement {
    Eigen::Vector3d target{0, 0, 0}, from{0, 0, 1};
    double distance = 6, extent = 8;
    int width = 320, height = 180;
};

/// A camera and what it is called.
struct View {
    std::string name;
    fathom::Camera camera;
};

/// The same place seen by five cameras: perspective, off-centre, oblique near plane, infinite reversed, orthographic.
/// Their axes, clip conventions and row orders differ too.
std::vector<View> views(const Placement& placement);

/// Position on the screen, in pixels from the corner of the first stored one, where a world point appears.
Eigen::Vector2d pixel_of(const fathom::Camera& camera, const Eigen::Vector3d& world);

} // namespace oracle
