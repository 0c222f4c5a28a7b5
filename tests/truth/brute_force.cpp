#include "brute_force.hpp"

#include "parallel.hpp"

#include <algorithm>
#include <cmath>

namespace oracle {

std::vector<Sample> brute_force(const DepthLayer& layer, const std::vector<Eigen::Vector3d>& normals, double radius,
                                double thickness, int slices, int stride) {
    std::vector<Sample> points;
    for (int y = stride / 2; y < layer.height(); y += stride)
        for (int x = stride / 2; x < layer.width(); x += stride)
            if (std::isfinite(layer.inverse_depth(x, y)))
                points.push_back({x, y, 0});
    in_parallel(points.size(), [&](std::size_t i) {
        Sample& p = points[i];
        const auto at =
            static_cast<std::size_t>(p.y) * static_cast<std::size_t>(layer.width()) + static_cast<std::size_t>(p.x);
        p.visibility = screen_visibility(layer, p.x, p.y, normals[at], {radius, thickness, slices});
    });
    return points;
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

Off error_of(const std::vector<Sample>& points, const std::function<double(const Sample&)>& got) {
    std::vector<double> off;
    Off error;
    for (const Sample& point : points) {
        const double difference = got(point) - point.visibility;
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
