// Pseudo-linear depth, z w written per vertex: how wide a range of depths a triangle may span.
//   the rasteriser interpolates z linearly on the screen, where 1/z is linear

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/regime.hpp"

#include <algorithm>
#include <cmath>

namespace fathom::regimes {
namespace {

constexpr double near = 0.1, far = 1000, nearest = 1;
constexpr int width = 256, height = 16;
constexpr const char* off = "largest error of z, relative to the nearest vertex";

// An edge from the nearest to the farthest depth over so many pixels, cut into equal parts on the screen.
Point along_edge(const Device& device, double ratio, int parts) {
    Camera camera = camera_over(perspective(1.0, 16.0, {near, far}), width, height);
    camera.encoding = Encoding::pseudo_linear;
    camera.near_plane = near;
    camera.far_plane = far;
    const auto at = [ratio](double fraction) { return 1 / ((1 - fraction) / nearest + fraction / (nearest * ratio)); };
    std::vector<float> stored;
    std::vector<double> truth;
    for (int i = 0; i < width * height; ++i) {
        const double fraction = (i + 0.5) / (width * height);
        const double begin = std::floor(fraction * parts) / parts, along = (fraction - begin) * parts;
        truth.push_back(at(fraction));
        const double decoded = (1 - along) * at(begin) + along * at(begin + 1.0 / parts);
        stored.push_back(static_cast<float>((decoded - near) / (far - near)));
    }
    const auto z = images::floats(linearize(images::stored_of(device, stored, camera)).image);
    Point point{ratio, 0, 0};
    for (std::size_t i = 0; i < z.size(); ++i)
        point.error = std::max(point.error, std::abs(static_cast<double>(z[i]) - truth[i]));
    for (int part = 0; part < parts; ++part)
        point.bound =
            std::max(point.bound, pseudo_linear_bound(at(static_cast<double>(part) / parts), at((part + 1.0) / parts)));
    point.bound += 0x1p-24 * far; // of storing
    return point;
}

} // namespace

Regime w_range(const Device& device) {
    Regime regime{"w-range", "farthest / nearest vertex of a triangle"};
    for (double power = 0.02; power < 2.8; power *= 1.4) {
        const double ratio = std::pow(10.0, power);
        regime.panel(off).curve("one triangle").points.push_back(along_edge(device, ratio, 1));
        regime.panel(off).curve("cut in 8").points.push_back(along_edge(device, ratio, 8));
    }
    regime.boundaries = {{off, "one triangle", 0.01, 1.2, 1.28, "derived: pseudo_linear_bound"},
                         {off, "cut in 8", 0.01, 2, 2.5, "derived: pseudo_linear_bound"}};
    return regime;
}

} // namespace fathom::regimes
