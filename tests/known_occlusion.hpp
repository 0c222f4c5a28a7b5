#pragma once

// Scenes in which the visibility of a point is known in closed form, and cameras that see them.

#include "occlusion.hpp"

#include <string>
#include <vector>

namespace oracle {

/// A scene and what is known about it: the visibility of one point, for rays of one length.
/// The point lies on the plane z = 0 and in the world's origin, unless its function says otherwise.
struct Known {
    fathom::scene::Scene scene;
    double visibility;
    double radius = infinite;
    Eigen::Vector3d from{0, 0,
                         1}; ///< where a camera centre sees all that blocks: the scene is a height field from there
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
