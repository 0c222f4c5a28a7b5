// Thin occluders against the thickness that is assumed of them: square bars before a wall.

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/regime.hpp"

#include "scene/scene.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace fathom::regimes {
namespace {

using Eigen::Vector3d;

constexpr int width = 240, height = 96;
constexpr double reach = 0.8;
constexpr const char* off = "error of visibility, rms";
const double slope = std::tan(0.2), pixel = 3 * 2 * slope / height; // width of a pixel, 3 away

/// Upright bars of so many pixels, 0.4 before a wall, as deep as they are wide.
scene::Scene bars_of(int pixels) {
    scene::Scene scene{scene::Plane{{0, 0, -3.4}, {0, 0, 1}}};
    const double half = 0.5 * pixels * pixel;
    for (int bar = -8; bar <= 8; ++bar)
        scene.push_back(scene::Box{{24.3 * pixel * bar, 0, -3}, {half, 3, half}});
    return scene;
}

/// Fraction of rays that meet nothing.
double by_rays(const scene::Scene& scene, const Vector3d& position, const Vector3d& normal) {
    constexpr int side = 24;
    const Vector3d across = normal.unitOrthogonal(), along = normal.cross(across);
    std::mt19937 random(3);
    const auto stratified = [&random](int i, int count) {
        return (i + static_cast<double>(random() % 1024) / 1024) / count;
    };
    int open = 0;
    for (int i = 0; i < 2 * side * side; ++i) {
        const double sine2 = stratified(i / (2 * side), side),
                     azimuth = 2 * std::numbers::pi * stratified(i % (2 * side), 2 * side);
        const Vector3d ray =
            std::sqrt(sine2) * (std::cos(azimuth) * across + std::sin(azimuth) * along) + std::sqrt(1 - sine2) * normal;
        open += scene::blocked(scene, position, ray, reach) ? 0 : 1;
    }
    return static_cast<double>(open) / (2 * side * side);
}

/// Pixels of the wall and of bars, and what the scene says of them.
struct Judge {
    std::vector<std::size_t> pixels;
    std::vector<double> truth;

    Judge(const scene::Scene& scene, const scene::Rendered& image) {
        for (int x = 50; x < width - 50; x += 3) {
            const auto i = static_cast<std::size_t>((height / 2 + x % 5) * width + x);
            pixels.push_back(i);
            truth.push_back(by_rays(scene, image.position[i], image.normal[i]));
        }
    }
    double off(const std::vector<float>& visibility) const {
        double sum = 0;
        for (std::size_t i = 0; i < pixels.size(); ++i)
            sum += std::pow(static_cast<double>(visibility[pixels[i]]) - truth[i], 2);
        return std::sqrt(sum / static_cast<double>(pixels.size()));
    }
};

/// Where each pixel's solid ends: the far face of its bar; the wall goes on for ever.
std::vector<float> far_faces(const scene::Rendered& image, const Camera& camera, double half) {
    std::vector<float> stored;
    for (const Vector3d& p : image.position) {
        if (p.z() < -3.3) {
            stored.push_back(1);
            continue;
        }
        // The ray leaves the bar through its back or through the side that it runs towards.
        const double bar = std::round(p.x() / (24.3 * pixel)) * 24.3 * pixel;
        const double side = (p.x() > 0 ? bar + half : bar - half) / p.x();
        const double z = std::min(3 + half, -p.z() * std::max(side, 1.0));
        stored.push_back(static_cast<float>(stored_depth(camera, Storage::float32, 0, 0, z)));
    }
    return stored;
}

} // namespace

Regime thin_occluders(const Device& device) {
    Regime regime{"thickness", "assumed thickness / true thickness"};
    const Camera camera = camera_over(perspective(0.4, static_cast<double>(width) / height, {0.5, 500}), width, height);
    for (const int pixels : {2, 6}) {
        const scene::Scene scene = bars_of(pixels);
        const scene::Rendered image = scene::render(scene, camera);
        const Judge judge(scene, image);
        const StoredDepth stored = images::stored_of(device, image.stored, camera);
        const std::vector<float> backs = far_faces(image, camera, 0.5 * pixels * pixel);
        const std::string name = "bars of " + std::to_string(pixels) + " pixels";
        SsaoOptions layered;
        layered.thickness = images::stored_of(device, backs, camera);
        const double with_back = judge.off(images::floats(ssao(stored, reach, layered).visibility)),
                     by_default = judge.off(images::floats(ssao(stored, reach).visibility));
        for (const double times : {1 / 16.0, 1 / 8.0, 1 / 4.0, 1 / 2.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0}) {
            SsaoOptions options;
            options.thickness = times * pixels * pixel;
            regime.panel(off).curve(name).points.push_back(
                {times, judge.off(images::floats(ssao(stored, reach, options).visibility))});
            regime.panel(off).curve(name + ", default").points.push_back({times, by_default});
            regime.panel(off).curve(name + ", second layer").points.push_back({times, with_back});
        }
    }
    regime.boundaries = {
        {off, "bars of 2 pixels", 0.05, 2, 4, "measured"},
        {off, "bars of 6 pixels", 0.08, 1, 2, "measured", 0.5, none},
        {off, "bars of 6 pixels", 0.08, 0.5, 0.25, "measured", 1, none},
        {off, "bars of 2 pixels, second layer", 0.05, 0, none, "measured"},
        {off, "bars of 6 pixels, second layer", 0.05, 0, none, "measured"},
    };
    return regime;
}

} // namespace fathom::regimes
