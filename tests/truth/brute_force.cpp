#include "brute_force.hpp"

#include "parallel.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <variant>

namespace oracle {
namespace {

template <typename IsSurface>
std::vector<Sample> sample_points(int width, int height, int stride, const IsSurface& is_surface) {
    std::vector<Sample> points;
    for (int y = stride / 2; y < height; y += stride)
        for (int x = stride / 2; x < width; x += stride)
            if (is_surface(x, y))
                points.push_back({x, y, 0});
    return points;
}

/// Planes of the near and far end of what a camera sees, world space: positive inside, not of unit length.
Eigen::Matrix<double, 2, 4> clip_planes(const fathom::Camera& camera) {
    const fathom::Projection& projection = camera.projection;
    const Eigen::Matrix4d view = fathom::scene::to_world(camera).inverse();
    const Eigen::Matrix4d clip = projection.matrix.cast<double>() * view;
    const bool from_zero = projection.convention.clip_z == fathom::ClipZ::zero_to_one;
    Eigen::Matrix<double, 2, 4> planes;
    planes << clip.row(2) + (from_zero ? 0 : 1) * clip.row(3), clip.row(3) - clip.row(2);
    return planes;
}

/// How far a ray from a point inside stays inside, at most `length`.
double within(const Eigen::Matrix<double, 2, 4>& planes, const Eigen::Vector3d& start, const Eigen::Vector3d& direction,
              double length) {
    for (int i = 0; i < 2; ++i) {
        const double falls = -planes.row(i).head<3>().dot(direction), height = planes.row(i).dot(start.homogeneous());
        if (falls * length > height)
            length = std::max(height, 0.0) / falls;
    }
    return length;
}

constexpr double touching = 1e-7; ///< scene units: solids that are no farther apart have no gap

// Where a ray is inside a surface, from each place where it goes in to the one where it comes out.
std::vector<std::pair<double, double>> passages(const fathom::scene::Scene& surface, fathom::scene::Ray ray) {
    std::vector<std::pair<double, double>> list;
    bool inside = false;
    while (const auto met = fathom::scene::met(surface, ray)) {
        const double at = (met->position - ray.origin).dot(ray.direction);
        if (inside)
            list.back().second = at;
        else
            list.emplace_back(at, infinite);
        inside = !inside;
        ray.first = at + touching;
    }
    return list;
}

} // namespace

std::vector<Sample> brute_force(const DepthLayer& layer, const std::vector<Eigen::Vector3d>& normals, double radius,
                                double thickness, int slices, int stride) {
    std::vector<Sample> points = sample_points(layer.width(), layer.height(), stride,
                                               [&](int x, int y) { return std::isfinite(layer.inverse_depth(x, y)); });
    in_parallel(points.size(), [&](std::size_t i) {
        Sample& p = points[i];
        const auto at =
            static_cast<std::size_t>(p.y) * static_cast<std::size_t>(layer.width()) + static_cast<std::size_t>(p.x);
        p.visibility = screen_visibility(layer, p.x, p.y, normals[at], {radius, thickness, slices});
    });
    return points;
}

// Vogel's spiral: equal parts of the unit disk below the hemisphere, turned by another angle at each point.
std::vector<Sample> ray_traced(const fathom::scene::Scene& scene, const fathom::Camera& camera,
                               const fathom::scene::Rendered& image, double radius, int rays, int stride) {
    constexpr double golden_angle = std::numbers::pi * (3 - 2.23606797749979);
    const Eigen::Matrix4d to_world = fathom::scene::to_world(camera);
    const Eigen::Matrix<double, 2, 4> planes = clip_planes(camera);
    const auto index = [&](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
    };
    std::vector<Sample> points = sample_points(image.width, image.height, stride,
                                               [&](int x, int y) { return std::isfinite(image.z[index(x, y)]); });
    in_parallel(points.size(), [&](std::size_t i) {
        Sample& p = points[i];
        const std::size_t at = index(p.x, p.y);
        const Eigen::Vector3d position = (to_world * image.position[at].homogeneous()).head<3>();
        const Eigen::Vector3d normal = to_world.topLeftCorner<3, 3>() * image.normal[at];
        const Eigen::Vector3d across = normal.unitOrthogonal(), along = normal.cross(across);
        int open = 0;
        for (int ray = 0; ray < rays; ++ray) {
            const double square = (ray + 0.5) / rays, azimuth = golden_angle * (ray + static_cast<double>(i));
            const Eigen::Vector3d outward = std::cos(azimuth) * across + std::sin(azimuth) * along;
            const Eigen::Vector3d direction = std::sqrt(square) * outward + std::sqrt(1 - square) * normal;
            open += !blocked(scene, position, direction, within(planes, position, direction, radius));
        }
        p.visibility = static_cast<double>(open) / rays;
    });
    return points;
}

std::vector<float> ends_of(const fathom::scene::Scene& scene, const fathom::Camera& camera) {
    const fathom::scene::Caster caster(scene, camera);
    const Eigen::Matrix4d to_world = fathom::scene::to_world(camera);
    const auto width = static_cast<std::size_t>(camera.width);
    std::vector<float> ends(width * static_cast<std::size_t>(camera.height));
    in_parallel(ends.size(), [&](std::size_t i) {
        const fathom::scene::Ray seen =
            caster.ray(static_cast<double>(i % width) + 0.5, static_cast<double>(i / width) + 0.5);
        const double unit = seen.direction.norm();
        fathom::scene::Ray ray{(to_world * seen.origin.homogeneous()).head<3>(),
                               to_world.topLeftCorner<3, 3>() * seen.direction / unit, seen.first * unit,
                               seen.last * unit};
        const auto met = fathom::scene::met(scene, ray);
        ends[i] = std::numeric_limits<float>::quiet_NaN();
        if (!met)
            return;
        const double start = (met->position - ray.origin).dot(ray.direction);
        ray.last = infinite;
        std::vector<std::pair<double, double>> solid;
        for (const fathom::scene::Primitive& primitive : scene)
            if (!std::holds_alternative<fathom::scene::Disk>(primitive))
                for (const auto& passage : passages({primitive}, ray))
                    solid.push_back(passage);
        double end = start;
        const auto goes_on = [&](const auto& passage) {
            return passage.first <= end + touching && passage.second > end + touching;
        };
        for (auto next = std::ranges::find_if(solid, goes_on); next != solid.end();
             next = std::ranges::find_if(solid, goes_on))
            end = next->second;
        if (end == start) // a disk
            end = infinite;
        ends[i] = static_cast<float>(std::abs(seen.origin.z() + end * seen.direction.z() / unit));
    });
    return ends;
}

double median_width(const DepthLayer& layer) {
    std::vector<double> widths;
    const auto& sight = layer.sight();
    const double step = (sight.is_orthographic ? sight.origin_x : sight.direction_x).norm();
    for (int y = 2; y < layer.height(); y += 5)
        for (int x = 2; x < layer.width(); x += 5)
            if (std::isfinite(layer.inverse_depth(x, y)))
                widths.push_back(layer.width() * step / (sight.is_orthographic ? 1 : layer.inverse_depth(x, y)));
    std::ranges::nth_element(widths, widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2));
    return widths[widths.size() / 2];
}

Off error_of(const std::vector<Sample>& points, const std::vector<float>& image, int width) {
    std::vector<double> off;
    Off error;
    for (const Sample& point : points) {
        const auto at =
            static_cast<std::size_t>(point.y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(point.x);
        const double difference = static_cast<double>(image[at]) - point.visibility;
        error.rmse += difference * difference;
        error.bias += difference;
        off.push_back(std::abs(difference));
    }
    std::ranges::sort(off);
    const auto count = static_cast<double>(points.size());
    error.rmse = std::sqrt(error.rmse / count);
    error.bias /= count;
    error.p99 = off[static_cast<std::size_t>(0.99 * (count - 1))];
    error.worst = off.back();
    off.resize(static_cast<std::size_t>(0.98 * count));
    for (const double difference : off)
        error.common += difference * difference;
    error.common = std::sqrt(error.common / static_cast<double>(off.size()));
    return error;
}

} // namespace oracle
