// What lies outside the image: a floor beside a wall, seen from straight above, as a function of the distance from the border.

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/regime.hpp"
#include "regimes/walls.hpp"

#include <cmath>
#include <limits>

namespace fathom::regimes {
namespace {

constexpr int radius = 32; // pixels, which are a unit wide
constexpr const char* beyond = "error of visibility, the wall just outside";
constexpr const char* across = "error of visibility, the wall runs out of the image";

// Depth of a wall over the columns before its foot, as its camera sees it.
std::vector<float> visibility_of(const Device& device, int width, int height, int foot, Border border) {
    Camera camera =
        camera_over(orthographic({-width / 2.0, width / 2.0, -height / 2.0, height / 2.0}, {0.5, 1e3}), width, height);
    camera.encoding = Encoding::view_z;
    std::vector<float> depth(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (std::size_t i = 0; i < depth.size(); ++i)
        depth[i] = static_cast<int>(i % static_cast<std::size_t>(width)) < foot ? 1.0f : 1.0f + 2 * radius;
    SsaoOptions options;
    options.thickness = std::numeric_limits<double>::infinity();
    options.border = border;
    return images::floats(ssao(images::stored_of(device, depth, camera), radius, options).visibility);
}

// The image begins at the wall's foot. Rows of the middle are judged; the depth has `overscan` more columns on the
// wall's side.
void sweep_beyond(const Device& device, Panel& panel, const char* name, int overscan) {
    constexpr int seen = 64, height = 3 * radius;
    const int width = seen + overscan;
    const auto visibility = visibility_of(device, width, height, overscan, Border::open);
    for (int x = 0; x < seen; x += x < 8 ? 1 : 4) {
        const double distance = (x + 0.5) / radius, truth = beside_wall(distance);
        const double got = static_cast<double>(visibility[static_cast<std::size_t>(height / 2 * width + overscan + x)]);
        panel.curve(name).points.push_back({distance, std::abs(got - truth)});
    }
}

// The wall's foot runs up to the image's first row; a quarter of a radius beside it.
void sweep_across(const Device& device, Panel& panel, const char* name, int overscan, Border border) {
    constexpr int width = 3 * radius, foot = radius, seen = 3 * radius;
    const int height = seen + overscan, x = foot + radius / 4;
    const auto visibility = visibility_of(device, width, height, foot, border);
    for (int y = 0; y < 2 * radius; y += y < 8 ? 1 : 4) {
        const double truth = beside_wall((x + 0.5 - foot) / radius);
        const double got = static_cast<double>(visibility[static_cast<std::size_t>((overscan + y) * width + x)]);
        panel.curve(name).points.push_back({(y + 0.5) / radius, std::abs(got - truth)});
    }
}

} // namespace

Regime border_of_the_image(const Device& device) {
    Regime regime{"border", "distance from the border, radii"};
    sweep_beyond(device, regime.panel(beyond), "as it is", 0);
    sweep_beyond(device, regime.panel(beyond), "rendered a radius wider", radius);
    for (Point& point : regime.panel(beyond).curve("as it is").points)
        point.bound = 1 - beside_wall(point.parameter) + 0.02;
    sweep_across(device, regime.panel(across), "border open", 0, Border::open);
    sweep_across(device, regime.panel(across), "border clamped", 0, Border::clamp);
    sweep_across(device, regime.panel(across), "rendered a radius wider", radius, Border::open);
    regime.boundaries = {
        {beyond, "as it is", 0.03, 0.89, 0.77, "derived: all that an infinite wall hides"},
        {beyond, "rendered a radius wider", 0.03, 0, none, "measured"},
        {across, "border open", 0.04, 0.39, 0.27, "measured"},
        {across, "border clamped", 0.03, 0, none, "measured"},
        {across, "rendered a radius wider", 0.03, 0, none, "measured"},
    };
    return regime;
}

} // namespace fathom::regimes
