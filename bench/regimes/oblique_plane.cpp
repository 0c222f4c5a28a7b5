// An oblique near plane spends the depth's steps between two planes that meet at the camera centre's depth: what is left
// of them as it turns along the view direction, and as it comes near the camera centre.
//   the step of 1/z is N.D_Q / delta steps of the stored value
//   delta: from the camera centre to the plane,  D_Q: Lengyel's corner

#include "camera_over.hpp"
#include "regimes/corner.hpp"

#include <cmath>
#include <numbers>

namespace fathom::regimes {
namespace {

constexpr double edge = 5, from = 0.5; // the left half of the image is what the plane cuts off

constexpr const char* storing = "derived: half a step of the buffer";
constexpr const char* normals_of_it = "derived: normals_slope_error";

struct Kind {
    const char* name;
    Buffer buffer;
    DepthOrder order = DepthOrder::standard;
};
constexpr Kind kinds[] = {{"D16", {16}}, {"D24", {24}}, {"D32F", {32}}, {"D32F reversed", {32}, DepthOrder::reversed}};

// The plane, turned by an angle from the view direction, at a distance from the camera centre.
Corner behind(double angle, double distance, DepthOrder order) {
    const Projection wide = perspective(1.0, static_cast<double>(corner_width) / corner_height, {0.1, 100, order});
    const Eigen::Vector4d plane(std::cos(angle), 0, -std::sin(angle), -distance);
    return Corner(camera_over(with_oblique_near_plane(wide, plane), corner_width, corner_height), edge, from);
}

} // namespace

Regime oblique_angle(const Device& device) {
    Regime regime{"oblique-angle", "angle between near plane and view direction, degrees"};
    for (const Kind& kind : kinds)
        for (double power = 1.75; power >= -5; power -= power > -1 ? 0.25 : 0.5) {
            const double degrees = std::pow(10.0, power), angle = degrees * std::numbers::pi / 180;
            add(regime, kind.name, degrees,
                corner_errors(device, behind(angle, 3 * std::sin(angle), kind.order), kind.buffer));
        }
    regime.boundaries = {
        {quantity::depth, "D16", 0.01, 0.31, 0.18, storing},
        {quantity::depth, "D24", 0.01, 9.9e-4, 3.2e-4, storing},
        {quantity::normal, "D16", 1, 3.1, 1.8, normals_of_it},
        {quantity::normal, "D24", 1, 0.031, 0.011, normals_of_it},
        {quantity::visibility, "D16", 0.02, 31, 18, "measured"},
        {quantity::visibility, "D24", 0.02, 0.099, 0.032, "measured"},
        {quantity::circle, "D16", 0.1, 0.31, 0.18, storing},
        {quantity::circle, "D24", 0.1, 9.9e-4, 3.2e-4, storing},
    };
    return regime;
}

Regime oblique_distance(const Device& device) {
    Regime regime{"oblique-distance", "distance of the camera centre from the near plane, scene units"};
    for (const Kind& kind : kinds)
        for (double power = 0.5; power >= -6; power -= 0.5) {
            const double distance = std::pow(10.0, power);
            add(regime, kind.name, distance,
                corner_errors(device, behind(60 * std::numbers::pi / 180, distance, kind.order), kind.buffer));
        }
    regime.boundaries = {
        {quantity::depth, "D16", 0.01, 0.031, 0.011, storing},
        {quantity::depth, "D24", 0.01, 9.9e-5, 3.2e-5, storing},
        {quantity::normal, "D16", 1, 0.31, 0.11, normals_of_it},
        {quantity::normal, "D24", 1, 3.1e-3, 1.1e-3, normals_of_it},
        {quantity::visibility, "D16", 0.02, 0.99, 0.32, "measured"},
        {quantity::visibility, "D24", 0.02, 9.9e-3, 3.2e-3, "measured"},
        {quantity::circle, "D16", 0.1, 0.031, 0.011, storing},
        {quantity::circle, "D24", 0.1, 9.9e-5, 3.2e-5, storing},
    };
    return regime;
}

} // namespace fathom::regimes
