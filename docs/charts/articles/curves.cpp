// The curves of the articles' figures: the library's own projections and encodings, asked for normalised depth.

#include "articles/curves.hpp"

#include <fathom/camera.hpp>

#include <cmath>
#include <limits>
#include <numbers>

namespace fathom::charts {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Two pixels a side: the corner that they share lies straight ahead.
double normalised(const Projection& projection, double z) {
    Camera camera;
    camera.projection = projection;
    camera.width = camera.height = 2;
    return 2 * static_cast<double>(stored_depth(camera, Storage::float32, 1, 1, z)) - 1;
}

Projection figure_5_frustum(double far) {
    const double near = std::isfinite(far) ? far / 8 : 1; // replaced by the plane
    const FrustumEdges& edges = figure_5_edges;
    return perspective(FrustumEdges{near * edges.left, near * edges.right, near * edges.bottom, near * edges.top},
                       {near, far});
}

} // namespace

Eigen::Vector4d turned_plane(double degrees, double distance) {
    const double angle = degrees * std::numbers::pi / 180;
    return {std::sin(angle), 0, -std::cos(angle), -distance};
}

Projection with_turned_plane(double degrees, double distance, double far) {
    return with_oblique_near_plane(figure_5_frustum(far), turned_plane(degrees, distance));
}

double depth_at_infinity(double degrees, double distance, double far) {
    return normalised(with_turned_plane(degrees, distance, far), infinity);
}

bool leaves_something(double degrees, double distance) {
    const Eigen::Vector4d plane = turned_plane(degrees, distance);
    const double deepest = plane.x() * figure_5_edges.right - plane.z();
    return deepest * figure_5_far > distance;
}

double standard_depth(double near, double far, double z) {
    return normalised(perspective(FrustumEdges{-near, near, -near, near}, {near, far}), z);
}

double median_depth(double median, double z) {
    Camera camera;
    camera.projection = perspective(FrustumEdges{-1, 1, -1, 1}, {1, infinity});
    camera.width = camera.height = 2;
    camera.encoding = Encoding::median;
    camera.median = median;
    return 2 * static_cast<double>(stored_depth(camera, Storage::float32, 1, 1, z)) - 1;
}

} // namespace fathom::charts
