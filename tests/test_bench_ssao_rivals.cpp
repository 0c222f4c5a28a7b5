// The methods that ssao is compared with (bench/ssao_rivals.hpp) compute what they are meant to: a rival with a fault in it is
// none.

#include "catch.hpp"
#include "judge.hpp"
#include "occlusion.hpp"
#include "scene/scene.hpp"

#include "ssao_rivals.hpp"

#include <fathom/fathom.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace fathom;
using Eigen::Vector3d;

namespace {

constexpr int width = 161, height = 121;
constexpr double radius = 1; // about 20 pixels

struct Depth {
    Camera camera;
    scene::Rendered image;
    StoredDepth stored;

    Depth(const scene::Scene& scene, const Camera& from) : camera(from), image(scene::render(scene, camera)) {
        stored = {Image::from_host(oracle::device(Arithmetic::fp64), Element::f32, image.stored.data(),
                                   {camera.width, camera.height}),
                  camera};
    }
    Depth(const Depth&) = delete;
};

std::size_t index(int x, int y) {
    return static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
}

/// Are it and the four pixels beside it a surface? Without them an image does not tell the slope.
bool has_neighbours(const Depth& depth, int x, int y) {
    const std::pair<int, int> all[] = {{x, y}, {x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}};
    return std::ranges::all_of(all, [&](auto at) { return std::isfinite(depth.image.z[index(at.first, at.second)]); });
}

/// What a method makes of it.
template <typename Method>
std::vector<float> result_of(Method&& method, const StoredDepth& stored) {
    const Image target(stored.image.device(), Element::f32, {stored.image.width(), stored.image.height()});
    method.run(target);
    std::vector<float> values(static_cast<std::size_t>(target.width()) * static_cast<std::size_t>(target.height()));
    target.download(values.data());
    return values;
}

std::vector<float> swept(const StoredDepth& stored, double length, int slices) {
    return result_of(bench::LineSweep(stored, length, slices), stored);
}

std::vector<float> obscured(const StoredDepth& stored, bench::Falloff falloff, double intensity) {
    return result_of(bench::Obscurance(stored, radius, 1, 32, falloff, intensity), stored);
}

constexpr std::pair<const char*, bench::Falloff> falloffs[] = {{"HBAO+", bench::Falloff::hbao_plus},
                                                               {"scalable", bench::Falloff::scalable}};

/// Does the image show all that lies within the radius?
bool far_from_border(int x, int y) {
    return x >= 50 && x < width - 50 && y >= 45 && y < height - 45;
}

} // namespace

TEST_CASE("ssao rivals: a plane that nothing rises above is open", "[ssao][rivals]") {
    for (const double tilt : {0.0, 40.0, 70.0}) {
        const oracle::Known known = oracle::open_plane(tilt * std::numbers::pi / 180, 0.4);
        for (const oracle::View& view : oracle::views({.width = width, .height = height})) {
            const Depth depth(known.scene, view.camera);
            const auto check = [&](const char* method, const std::vector<float>& got) {
                double least = 1;
                for (int y = 1; y < height - 1; ++y) {
                    for (int x = 1; x < width - 1; ++x) {
                        if (has_neighbours(depth, x, y))
                            least = std::min(least, static_cast<double>(got[index(x, y)]));
                    }
                }
                INFO(method << ", tilt " << tilt << ", " << view.name);
                CHECK(least >= 1 - ssao_plane_error);
            };
            check("line sweep", swept(depth.stored, radius, 4));
            for (const auto& [falloff_name, falloff] : falloffs)
                check(falloff_name, obscured(depth.stored, falloff, 1));
        }
    }
}

TEST_CASE("ssao rivals: the line sweep of height fields is the double quadrature's", "[ssao][rivals]") {
    constexpr double bar = 0.01; // root of the mean square: what balanced aims at
    const std::pair<const char*, oracle::Known> fields[] = {
        {"crease 135", oracle::crease(0.75 * std::numbers::pi, 0.5)},
        {"bowl", oracle::bowl(2, 1)},
        {"infinite wall", oracle::infinite_wall(0.5, radius)}};
    for (const auto& [field, known] : fields) {
        const oracle::Placement placement{
            .target = known.position, .from = known.from, .width = width, .height = height};
        for (const auto& [name, camera] : oracle::views(placement)) {
            const Depth depth(known.scene, camera);
            const auto got = swept(depth.stored, radius, 16);
            const Eigen::Matrix4d world = scene::to_world(camera);
            double squares = 0;
            int count = 0;
            for (int y = 0; y < height; y += 5) {
                for (int x = 0; x < width; x += 7) {
                    if (!far_from_border(x, y) || !std::isfinite(depth.image.z[index(x, y)]))
                        continue;
                    const Vector3d position = (world * depth.image.position[index(x, y)].homogeneous()).head<3>();
                    const Vector3d normal = world.topLeftCorner<3, 3>() * depth.image.normal[index(x, y)];
                    const double truth = oracle::visibility(known.scene, position, normal, radius, 64, 32);
                    squares += std::pow(static_cast<double>(got[index(x, y)]) - truth, 2);
                    ++count;
                }
            }
            const double rmse = std::sqrt(squares / count);
            std::printf("line sweep, %s, %s: root of the mean square error %.4f, %d points\n", field, name.c_str(),
                        rmse, count);
            INFO(field << ", " << name);
            CHECK(count > 15);
            CHECK(rmse <= bar);
        }
    }
}

TEST_CASE("ssao rivals: the line sweep of a whole bowl", "[ssao][rivals]") {
    // The bowl's rim, 60 degrees steep, is where the image has it, to a pixel: h of 1 - h/(2 r) is off by so much.
    constexpr double extent = 8, size = 2;
    const double rim = extent / width * std::sqrt(3.0) / (2 * size);
    const oracle::Known known = oracle::bowl(size, 1);
    const auto views = oracle::views(
        {.target = known.position, .from = known.from, .extent = extent, .width = width, .height = height});
    const Depth depth(known.scene, views.back().camera);
    const auto got = swept(depth.stored, 100, 32);
    const Eigen::Vector2d pixel = oracle::pixel_of(depth.camera, known.position);
    const double off =
        static_cast<double>(got[index(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))]) - known.visibility;
    std::printf("line sweep, bowl, infinite radius: %+.4f from 1 - h/(2 r), a pixel of its rim is %.4f\n", off, rim);
    CHECK(std::abs(off) <= rim);
}

TEST_CASE("ssao rivals: obscurance beside a wall is the mean of its formula", "[ssao][rivals]") {
    // Straight from above: what lies s away on the wall's top is h higher, the mean is over a turn and over s to the radius.
    constexpr double wall = 0.5;
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.projection = orthographic({-4, 4, -3, 3}, {0, 10});
    const scene::Scene scene{scene::Plane{{0, 0, -5}, {0, 0, 1}}, scene::Box{{2, 0, -5}, {2, 1e3, wall}}};
    const Depth depth(scene, camera);
    for (const auto& [name, falloff] : falloffs) {
        const auto got = obscured(depth.stored, falloff, 0.5);
        double worst = 0;
        for (int x = 62; x < 79; x += 2) {
            const double away = -(-4 + 8 * (x + 0.5) / width);
            double sum = 0;
            constexpr int turns = 400, steps = 400;
            for (int i = 0; i < turns; ++i) {
                const double across = std::cos(2 * std::numbers::pi * (i + 0.5) / turns);
                for (int k = 0; k < steps; ++k) {
                    const double s = (k + 0.5) / steps, square = s * s + wall * wall, rest = std::max(0.0, 1 - square);
                    const double worth =
                        falloff == bench::Falloff::hbao_plus ? rest : rest * rest * rest / std::sqrt(square);
                    sum += s * across > away ? std::max(0.0, wall / std::sqrt(square) - 0.01) * worth : 0;
                }
            }
            const double truth = 1 - 0.5 * sum / (turns * steps);
            worst = std::max(worst, std::abs(static_cast<double>(got[index(x, height / 2)]) - truth));
        }
        std::printf("obscurance %s beside a wall: worst difference from its formula %.4f\n", name, worst);
        INFO(name);
        CHECK(worst <= 0.01);
    }
}
