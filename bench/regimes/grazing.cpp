// Grazing surfaces: planes and the foot of a wall under an orthographic projection, whose rays meet a plane at one
// angle everywhere, and a floor up to its horizon.

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/corner.hpp"
#include "regimes/normal_bound.hpp"
#include "regimes/walls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace fathom::regimes {
namespace {

constexpr int width = 128, height = 96, margin = 4;
constexpr double degree = std::numbers::pi / 180, extent = 4, radius = 0.5; // 16 pixels
constexpr const char* lost = "visibility lost by a plane, largest";
constexpr const char* at_foot = "error of visibility at a wall's foot, rms";

Camera orthographic_camera(double near, double far) {
    return camera_over(orthographic({-extent / 2, extent / 2, -0.375 * extent, 0.375 * extent}, {near, far}), width,
                       height);
}

double angle_degrees(const float* got, const Eigen::Vector3d& truth) {
    const Eigen::Vector3d n(got[0], got[1], got[2]);
    return n.isZero() ? 90 : std::atan2(n.cross(truth).norm(), std::max(n.dot(truth), 0.0)) / degree;
}

void sweep_planes(const Device& device, Regime& regime, double grazing) {
    const double deep = 0.625 * extent / std::tan(grazing * degree);
    const Camera camera = orthographic_camera(1, 3 + 2 * deep);
    const scene::Rendered truth = scene::render(
        {scene::Plane{{0, 0, -2 - deep}, {std::cos(grazing * degree), 0, std::sin(grazing * degree)}}}, camera);
    const StoredDepth stored = images::stored_of(device, truth.stored, camera);
    const auto found = images::floats(normals(stored));
    const auto visibility = images::floats(ssao(stored, radius).visibility);
    const NormalBound bound(camera);
    Point angle{grazing, 0, 0}, open{grazing, 0};
    for (int y = margin; y < height - margin; ++y)
        for (int x = margin; x < width - margin; ++x) {
            const auto i = static_cast<std::size_t>(y * width + x);
            angle.error = std::max(angle.error, angle_degrees(&found[3 * i], truth.normal[i]));
            angle.bound = std::max(angle.bound, bound.degrees(x, y, truth.z[i], truth.normal[i]));
            open.error = std::max(open.error, 1 - static_cast<double>(visibility[i]));
        }
    regime.panel(quantity::normal).curve("plane").points.push_back(angle);
    regime.panel(lost).curve("plane").points.push_back(open);
}

// A floor that is met at the angle, and a wall upright on it, across the image's middle; judged is what lies within 16
// pixels of the foot.
void sweep_foot(const Device& device, Regime& regime, double grazing) {
    const double s = std::sin(grazing * degree), c = std::cos(grazing * degree), nearer = 0.4 * extent * c / s;
    const Camera camera = orthographic_camera(1, 4 + nearer + 0.4 * extent * s / c);
    const Eigen::Vector3d foot(0, 0.01, -2 - nearer); // between two rows
    const scene::Rendered truth =
        scene::render({scene::Plane{foot, {0, c, s}}, scene::Plane{foot, {0, -s, c}}}, camera);
    for (const auto& [name, thickness] : {std::pair{"infinite thickness", std::numeric_limits<double>::infinity()},
                                          {"a quarter of the radius thick", radius / 4}}) {
        SsaoOptions options;
        options.thickness = thickness;
        options.border = Border::clamp;
        const auto visibility =
            images::floats(ssao(images::stored_of(device, truth.stored, camera), radius, options).visibility);
        double sum = 0;
        long pixels = 0;
        for (int y = height / 2 - 16; y < height / 2 + 16; ++y)
            for (int x = margin; x < width - margin; ++x) {
                const auto i = static_cast<std::size_t>(y * width + x);
                const double distance = (truth.position[i] - foot).tail<2>().norm();
                sum += std::pow(static_cast<double>(visibility[i]) - beside_wall(distance / radius), 2);
                ++pixels;
            }
        regime.panel(at_foot).curve(name).points.push_back({grazing, std::sqrt(sum / static_cast<double>(pixels))});
    }
}

// A floor one below the camera centre. Rows below the horizon are met at their own angle of depression.
void sweep_floor(const Device& device, Regime& regime) {
    for (const auto& [name, field] : {std::pair{"floor, 69 degrees high", 1.2}, {"floor, 7 degrees high", 0.12}}) {
        const Camera camera = camera_over(perspective(field, 4.0 / 3, {0.5, 1e4}), width, height);
        const scene::Rendered truth = scene::render({scene::Plane{{0, -1, 0}, {0, 1, 0}}}, camera);
        const auto found = images::floats(normals(images::stored_of(device, truth.stored, camera)));
        const NormalBound bound(camera);
        for (int y = height / 2 + 2; y < height - margin; y += 1 + (y - height / 2) / 8) {
            const double depression = std::atan2((y + 0.5 - height / 2.0) * 2 * std::tan(field / 2), height);
            Point angle{depression / degree, 0, 0};
            for (int x = width / 2 - 8; x < width / 2 + 8; ++x) {
                const auto i = static_cast<std::size_t>(y * width + x);
                angle.error = std::max(angle.error, angle_degrees(&found[3 * i], truth.normal[i]));
                angle.bound = std::max(angle.bound, bound.degrees(x, y, truth.z[i], truth.normal[i]));
            }
            regime.panel(quantity::normal).curve(name).points.push_back(angle);
        }
    }
}

} // namespace

Regime grazing_angle(const Device& device) {
    Regime regime{"grazing-angle", "angle between view ray and surface, degrees"};
    for (double power = 1.75; power >= -3; power -= 0.25) {
        sweep_planes(device, regime, std::pow(10.0, power));
        if (power >= -1)
            sweep_foot(device, regime, std::pow(10.0, power));
    }
    sweep_floor(device, regime);
    regime.boundaries = {
        {quantity::normal, "plane", 1e-3, 0, none, "derived: normals_slope_error"},
        {lost, "plane", ssao_plane_error, 0, none, "promised: ssao_plane_error"},
        {at_foot, "infinite thickness", 0.035, 0, none, "measured"},
        {at_foot, "a quarter of the radius thick", 0.035, 9.9, 5.7, "measured"},
    };
    return regime;
}

} // namespace fathom::regimes
