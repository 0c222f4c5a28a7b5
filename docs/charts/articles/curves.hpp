#pragma once

#include <fathom/projection.hpp>

/// The curves of the articles' figures, as the library answers them. tests/test_article_figures.cpp compares them with
/// the articles' own formulas.
namespace fathom::charts {

/// The frustum that the plane of Lengyel's Figure 5 is turned in: slopes of its edges, and its far distance.
/// The article does not name its own; only slopes and the ratio of distances matter.
inline constexpr FrustumEdges figure_5_edges{-0.5, 0.5, -0.4, 0.4};
inline constexpr double figure_5_far = 1;

/// That frustum with its near plane turned about the vertical axis, at a distance from the camera (perpendicular).
/// Throws: std::invalid_argument if nothing of the frustum is left.
Projection with_turned_plane(double degrees, double distance, double far = figure_5_far);

/// The plane itself, as `with_oblique_near_plane` takes it: unit normal, then minus the distance.
Eigen::Vector4d turned_plane(double degrees, double distance);

/// Lengyel's Figure 5: the normalised depth (−1 near, 1 far) that a point straight ahead approaches as it goes to
/// infinity. Above 1 the far plane cuts the axis; the figure is clamped there.
double depth_at_infinity(double degrees, double distance, double far = figure_5_far);

/// Whether anything of the frustum lies behind the plane.
bool leaves_something(double degrees, double distance);

/// Kooima's curves: normalised depth, −1 to 1, over the distance from the camera.
double standard_depth(double near, double far, double z); ///< `far` may be infinity
double median_depth(double median, double z);

} // namespace fathom::charts
