#include "lens_blur.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>

namespace lens_blur {

bool ApertureShape::open(double x, double y) const {
    if (corners == 0) {
        const double turn = turned_degrees * std::numbers::pi / 180, longer = std::max(ratio, 1.0);
        const double along = x * std::cos(turn) + y * std::sin(turn), aside = y * std::cos(turn) - x * std::sin(turn);
        const double across = along * longer, up = aside * longer / ratio; // half the axes 1/longer and ratio/longer
        return across * across + up * up < 1;
    }
    // Inside of every side: the sides' normals point half way between two corners.
    const double half = std::numbers::pi / corners, inner = std::cos(half);
    for (int i = 0; i < corners; ++i) {
        const double angle = (90 + turned_degrees) * std::numbers::pi / 180 + half * (2 * i + 1);
        if (x * std::cos(angle) + y * std::sin(angle) >= inner)
            return false;
    }
    return true;
}

std::vector<double> shares(const ApertureShape& aperture_shape, bool down, int positions) {
    constexpr int across = 1024;
    std::vector<double> shares(static_cast<std::size_t>(positions));
    double sum = 0;
    for (int i = 0; i < positions; ++i) {
        const double along = (2 * i + 1.0) / positions - 1;
        int open = 0;
        for (int j = 0; j < across; ++j) {
            const double aside = (2 * j + 1.0) / across - 1;
            open += down ? aperture_shape.open(aside, -along) : aperture_shape.open(along, aside);
        }
        shares[static_cast<std::size_t>(i)] = open;
        sum += open;
    }
    for (double& share : shares)
        share /= sum;
    return shares;
}

double light(const std::vector<Layer>& nearest_first, const std::vector<double>& shares, double position) {
    double sum = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const double along = (2 * static_cast<double>(i) + 1) / static_cast<double>(shares.size()) - 1;
        // Light of a point q behind the focus arrives at q + r u: the circle is the lens's own picture, upright.
        const auto from = [&](const Layer& layer) { return position - layer.circle / 2 * along; };
        const auto met = std::find_if(nearest_first.begin(), nearest_first.end(),
                                      [&](const Layer& layer) { return layer.here(from(layer)); });
        if (met == nearest_first.end())
            throw std::logic_error("a ray meets no layer");
        sum += shares[i] * met->color(from(*met));
    }
    return sum;
}

double light(const std::vector<Slope>& nearest_first, const ApertureShape& aperture_shape, double x, double y,
             int positions) {
    double sum = 0;
    long rays = 0;
    for (int i = 0; i < positions * positions; ++i) {
        const double u = (2 * (i % positions) + 1.0) / positions - 1, v = (2 * (i / positions) + 1.0) / positions - 1;
        if (!aperture_shape.open(u, v))
            continue;
        const auto met = std::find_if(nearest_first.begin(), nearest_first.end(), [&](const Slope& layer) {
            // From row q with circle c(q): y = q - v c(q) / 2, v up.
            const double row = (y + v * layer.circle / 2) / (1 - v * layer.each_row / 2);
            return layer.here(x - (layer.circle + layer.each_row * row) / 2 * u, row);
        });
        if (met == nearest_first.end())
            throw std::logic_error("a ray meets no layer");
        sum += met->color;
        ++rays;
    }
    return sum / static_cast<double>(rays);
}

double half_plane(double t) {
    if (std::abs(t) >= 1)
        return t > 0 ? 1 : 0;
    return 0.5 + (t * std::sqrt(1 - t * t) + std::asin(t)) / std::numbers::pi;
}

} // namespace lens_blur
