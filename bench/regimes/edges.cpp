// Colours and depth that do not end at the same place: a picture's filter mixes colours over pixels, while depth has one of them,
// and depth may be moved against the picture.

#include "regimes/lens.hpp"
#include "regimes/regime.hpp"

#include <algorithm>
#include <cmath>

namespace fathom::regimes {
namespace {

constexpr const char* beside = "largest error beside a blurred edge, fraction of the step";
constexpr int side = 96, margin = 24;
constexpr double slant = 0.3; // radians from upright
constexpr double diameter = 24;
constexpr double most = 0.02;

double before_edge(int x, int y) {
    return -((x + 0.5 - side / 2) * std::cos(slant) + (y + 0.5 - side / 2) * std::sin(slant));
}

// A white half-plane before the focus and a sharp black ground: its colours are filtered over `width` pixels, and its depth
// covers `larger` pixels more.
double edge_off(const Device& device, Quality quality, double width, double larger) {
    const Picture picture(
        side, side, [larger](int x, int y) { return before_edge(x, y) + larger > 0 ? -diameter : 0.0; },
        [width](int x, int y) {
            const double d = before_edge(x, y);
            return width > 0 ? std::clamp(d / width + 0.5, 0.0, 1.0) : d > 0 ? 1.0 : 0.0;
        });
    const auto got = picture.blurred(device, quality);
    double largest = 0;
    for (int y = margin; y < side - margin; ++y)
        for (int x = margin; x < side - margin; ++x)
            largest = std::max(largest, std::abs(got[static_cast<std::size_t>(y * side + x)] -
                                                 half_plane(before_edge(x, y) / (diameter / 2))));
    return largest;
}

} // namespace

Regime filter_width(const Device& device) {
    Regime regime{"filter", "width of the picture's filter, pixels"};
    for (const Way& way : ways)
        for (const double width : {0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0})
            regime.panel(beside).curve(way.name).points.push_back({width, edge_off(device, way.quality, width, 0)});
    for (const Way& way : ways)
        regime.boundaries.push_back({beside, way.name, most, 2, 2.5, "wanted: no outline is seen"});
    return regime;
}

Regime depth_offset(const Device& device) {
    Regime regime{"offset", "pixels that depth shows the foreground larger"};
    for (const Way& way : ways)
        for (const double larger :
             {-4.0, -3.0, -2.0, -1.5, -1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0})
            regime.panel(beside).curve(way.name).points.push_back({larger, edge_off(device, way.quality, 1, larger)});
    for (const Way& way : ways)
        regime.boundaries.push_back({beside, way.name, most, 0, -0.25, "wanted: no outline is seen"});
    return regime;
}

} // namespace fathom::regimes
