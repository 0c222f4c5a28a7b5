// The lens: focus from the focal length to infinity, apertures from a pinhole to circles of hundreds of pixels, highlights.

#include "regimes/lens.hpp"
#include "regimes/corner.hpp"

#include <algorithm>
#include <cmath>

namespace fathom::regimes {
namespace {

constexpr const char* edge = "largest error of an edge, fraction of the step";
constexpr const char* two_edges = "largest error of an edge before an edge, fraction of the step";
constexpr const char* washed_out = "largest error of what is dark, relative";
constexpr const char* one_sum = "one running sum of floats";
constexpr const char* of_all = "circle, pixels";
constexpr const char* at_corner = "at z = 20";
constexpr const char* energy = "error of a highlight's energy, relative";

// A step across the image, behind the focus.
double edge_off(const Device& device, Quality quality, double diameter) {
    const int reach = static_cast<int>(diameter / 2) + 2;
    const Picture step(
        4 * reach, 2 * reach + 1, [diameter](int, int) { return diameter; },
        [reach](int x, int) { return x >= 2 * reach ? 1.0 : 0.0; });
    const auto got = step.blurred(device, quality);
    double largest = 0;
    for (int x = reach; x < 3 * reach; ++x)
        largest = std::max(largest, std::abs(got[static_cast<std::size_t>(reach * step.width + x)] -
                                             half_plane((x + 0.5 - 2 * reach) / (diameter / 2))));
    return largest;
}

// Before the focus a half-plane of 1, and behind the focus, half as blurred, a step from 0 to 1 half a radius beside its
// edge: F Phi(a) + B1 (Phi(m) - Phi(a)) + B0 (1 - Phi(m)), a = -d/r1, b = (d - g)/r2, m = max(a, b).
double two_edges_off(const Device& device, Quality quality, double diameter) {
    const double near_radius = diameter / 2, far_radius = diameter / 4;
    const int reach = static_cast<int>(diameter) + 4, beside = std::max(1, static_cast<int>(near_radius / 2));
    const Picture picture(
        2 * reach, 2 * reach, [&](int x, int) { return x < reach ? -diameter : diameter / 2; },
        [&](int x, int) { return x < reach || x >= reach + beside ? 1.0 : 0.0; });
    const auto got = picture.blurred(device, quality);
    double largest = 0;
    for (int x = reach - static_cast<int>(near_radius) - 1; x < reach + static_cast<int>(near_radius) + 1; ++x) {
        const double d = x + 0.5 - reach, a = -d / near_radius, b = (d - beside) / far_radius;
        largest = std::max(
            largest, std::abs(got[static_cast<std::size_t>(reach * picture.width + x)] - half_plane(std::max(a, b))));
    }
    return largest;
}

// A row that a highlight of three pixels stands in, summed from its start: what is left of it where a window of a disc's
// chord has only what is dark. Each sum is rounded to 2^-24 of itself.
Point summed_at_once(double bright, double dark, int chord) {
    std::vector<float> sums{0};
    for (int x = 0; x < 64; ++x)
        sums.push_back(sums.back() + static_cast<float>(x < 3 ? bright : dark));
    Point point{bright, 0, 2 * 0x1p-24 * (3 * bright + 64 * dark) * 64 / (chord * dark)};
    for (std::size_t x = 4; x + static_cast<std::size_t>(chord) < sums.size(); ++x) {
        const double mean = static_cast<double>(sums[x + static_cast<std::size_t>(chord)] - sums[x]) / chord;
        point.error = std::max(point.error, std::abs(mean / dark - 1));
    }
    return point;
}

} // namespace

Regime aperture(const Device& device) {
    Regime regime{"aperture", "diameter of the circle, pixels"};
    for (const Way& way : ways) {
        const bool promised = way.quality != Quality::fast;
        for (const double diameter :
             {0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 100.0, 200.0, 400.0, 512.0, 720.0})
            if (diameter <= 100 || way.quality != Quality::accurate)
                regime.panel(edge).curve(way.name).points.push_back(
                    {diameter, edge_off(device, way.quality, diameter),
                     promised && diameter <= 256 ? dof_edge_error : none});
        for (const double diameter : {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 100.0})
            if (way.quality != Quality::fast)
                regime.panel(two_edges).curve(way.name).points.push_back(
                    {diameter, two_edges_off(device, way.quality, diameter)});
    }
    regime.boundaries = {
        {edge, "fast", 0.02, 512, 720, "measured"},
        {edge, "balanced", dof_edge_error, 512, 720, "promised: dof_edge_error"},
        {edge, "accurate", dof_edge_error, 0, none, "promised: dof_edge_error"},
        {two_edges, "balanced", dof_edge_error, 2, 4, "promised for one edge: dof_edge_error"},
        {two_edges, "accurate", dof_edge_error, 0, none, "promised: dof_edge_error"},
    };
    return regime;
}

Regime highlights(const Device& device) {
    Regime regime{"highlights", "brightness of a highlight; 0.001 beside it"};
    constexpr int side = 81, half = side / 2;
    constexpr double diameter = 18, dark = 1e-3;
    for (double power = 0; power <= 12; ++power)
        regime.panel(washed_out)
            .curve(one_sum)
            .points.push_back(summed_at_once(std::pow(10.0, power), dark, static_cast<int>(diameter)));
    for (const Way& way : ways)
        for (double power = 0; power <= 32; power += power < 12 ? 1 : 2) {
            const double bright = std::pow(10.0, power);
            const Picture picture(
                side, side, [](int, int) { return diameter; },
                [&](int x, int y) { return std::abs(x - half) < 2 && std::abs(y - half) < 2 ? bright : dark; });
            const auto got = picture.blurred(device, way.quality);
            double worst = 0, sum = 0;
            for (int y = 0; y < side; ++y)
                for (int x = 0; x < side; ++x) {
                    const double value = got[static_cast<std::size_t>(y * side + x)];
                    if (std::hypot(x - half, y - half) > 0.6 * diameter + 12)
                        worst = std::max(worst, std::abs(value / dark - 1));
                    sum += value - dark;
                }
            regime.panel(washed_out).curve(way.name).points.push_back({bright, worst});
            regime.panel(energy).curve(way.name).points.push_back({bright, std::abs(sum / (9 * (bright - dark)) - 1)});
        }
    regime.boundaries = {
        {washed_out, "balanced", 1e-3, 0, none, "derived: 2^-24 of a running sum of what is below four"},
        {washed_out, one_sum, 1e-3, 10, 100, "derived: 2^-24 of a running sum"},
        {energy, "balanced", 1e-5, 1e30, 1e32, "stated: colours up to 1e30 are numbers"},
    };
    return regime;
}

Regime focus_distance(const Device& device) {
    Regime regime{"focus", "focus / focal length - 1"};
    Camera camera = camera_over(perspective(1.0, static_cast<double>(corner_width) / corner_height, {0.1, 100}),
                                corner_width, corner_height);
    const Corner corner(camera);
    camera.width = 1920; // of the picture that circles are meant for
    camera.height = 1440;
    for (double power = -6; power <= 6; power += 0.5) {
        const double nearer = std::pow(10.0, power), focal_length_mm = 85;
        const CircleOfConfusion lens = circle_of_confusion({.f_stop = 1.4,
                                                            .focus = focal_length_mm / 1000 * (1 + nearer),
                                                            .focal_length_mm = focal_length_mm,
                                                            .sensor_mm = 36},
                                                           camera);
        for (const auto& [name, bits] : {std::pair{"D16", 16}, {"D24", 24}, {"D32F", 32}}) {
            const CornerErrors errors = corner_errors(device, corner, {bits}, lens);
            regime.panel(quantity::circle).curve(name).points.push_back({nearer, errors.circle, errors.circle_bound});
        }
        regime.panel(of_all).curve(at_corner).points.push_back(
            {nearer, std::abs(static_cast<double>(coc_at(lens, 20)))});
    }
    regime.boundaries = {
        {quantity::circle, "D16", 0.1, 0.31, 0.11, "derived: half a step of the buffer"},
        {quantity::circle, "D24", 0.1, 3.1e-3, 1.1e-3, "derived: half a step of the buffer"},
        {of_all, at_corner, 512, 9.9, 3.2, "stated: dof clamps circles to 512"},
    };
    return regime;
}

} // namespace fathom::regimes
