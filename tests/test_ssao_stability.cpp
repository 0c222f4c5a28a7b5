// ssao where it is easily unstable: images of a few pixels, sky, holes, radii of no or many pixels, few bits of depth,
// grazing surfaces.

#include "catch.hpp"
#include "occlusion.hpp"
#include "scene/scene.hpp"
#include "stability.hpp"

#include <fathom/fathom.hpp>
#include <fathom/ssao.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace fathom;
using stability::camera_of;
using stability::not_a_number;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double plane_error = ssao_plane_error;
constexpr double quantised_plane_error = 0.02; // of a plane in few bits of depth

constexpr Quality qualities[] = {Quality::fast, Quality::balanced, Quality::accurate};
constexpr double thicknesses[] = {0.1, oracle::endless};

template <typename Value>
std::vector<float> visibility_of(const std::vector<Value>& values, const Camera& camera, const SsaoOptions& options,
                                 Storage storage = Storage::float32) {
    const Device& device = oracle::device(Arithmetic::fp64);
    const Image stored = Image::from_host(device, element_of(storage), values.data(),
                                          {camera.width, camera.height, channels_of(storage)});
    std::vector<float> visibility(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
    ssao({stored, camera, storage}, options).visibility.download(visibility.data());
    return visibility;
}

SsaoOptions options_of(double radius, Quality quality, std::optional<double> thickness = std::nullopt) {
    SsaoOptions options;
    options.radius = radius;
    options.quality = quality;
    options.thickness = thickness;
    return options;
}

bool in_range(float v) {
    return v >= 0 && v <= 1;
}

/// A perspective, at most 57 degrees wide and high, and parallel rays that see about the same.
std::vector<Camera> cameras(int width, int height) {
    const double aspect = static_cast<double>(width) / height;
    const double x = std::min(1.0, aspect), y = std::min(1.0, 1 / aspect);
    return {camera_of(perspective(FrustumEdges{-0.27 * x, 0.27 * x, -0.27 * y, 0.27 * y}, {0.5, 500}), width, height),
            camera_of(orthographic({-2 * x, 2 * x, -2 * y, 2 * y}, {0.5, 500}), width, height)};
}

std::string text(const Camera& camera, const SsaoOptions& options) {
    return std::to_string(camera.width) + " x " + std::to_string(camera.height) + ", quality " +
           std::to_string(static_cast<int>(options.quality)) + ", radius " + std::to_string(options.radius) +
           ", thickness " + std::to_string(options.thickness.value_or(-1));
}

} // namespace

TEST_CASE("stability: ssao of images of every small size", "[ssao][stability]") {
    const std::pair<int, int> sizes[] = {{1, 1}, {1, 2}, {2, 1},  {1, 57},  {57, 1},  {3, 3},  {2, 5},
                                         {5, 4}, {7, 7}, {17, 3}, {63, 65}, {65, 31}, {127, 1}};
    for (const auto& [width, height] : sizes) {
        for (const Camera& camera : cameras(width, height)) {
            const auto image = scene::render(scene::room(), camera);
            const auto plane = scene::render({scene::Plane{{0, 0, -3}, {0.3, 0.2, 1}}}, camera);
            for (const Quality quality : qualities) {
                for (const double thickness : thicknesses) {
                    const SsaoOptions options = options_of(0.5, quality, thickness);
                    INFO(text(camera, options));
                    const auto got = visibility_of(image.stored, camera, options);
                    CHECK(std::all_of(got.begin(), got.end(), in_range));
                    const auto open = visibility_of(plane.stored, camera, options);
                    CHECK(*std::min_element(open.begin(), open.end()) >= 1 - plane_error);
                    CHECK(std::all_of(open.begin(), open.end(), in_range));
                }
            }
        }
    }
}

TEST_CASE("stability: ssao of nothing but sky is 1, of nothing at all NaN", "[ssao][stability]") {
    for (const Camera& camera : cameras(61, 35)) {
        for (const Quality quality : qualities) {
            const SsaoOptions options = options_of(0.5, quality);
            INFO(text(camera, options));
            const auto sky = visibility_of(std::vector<float>(61 * 35, 1.0f), camera, options);
            CHECK(std::all_of(sky.begin(), sky.end(), [](float v) { return v == 1; }));
            const auto holes = visibility_of(std::vector<float>(61 * 35, not_a_number), camera, options);
            CHECK(std::all_of(holes.begin(), holes.end(), [](float v) { return std::isnan(v); }));
        }
    }
}

TEST_CASE("stability: ssao keeps NaN where the depth has none", "[ssao][stability]") {
    constexpr int width = 95, height = 71;
    for (const Camera& camera : cameras(width, height)) {
        auto stored = scene::render(scene::room(), camera).stored;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const bool island = std::hypot(x - 30, y - 30) < 9 || (x == 60 && y % 3 == 0) || (x == 0 && y == 0) ||
                                    (x > 80 && y > 60) || (y == 50 && x < 20);
                if (island)
                    stored[static_cast<std::size_t>(y * width + x)] = not_a_number;
            }
        }
        for (const Quality quality : qualities) {
            for (const double thickness : thicknesses) {
                const SsaoOptions options = options_of(0.5, quality, thickness);
                const auto got = visibility_of(stored, camera, options);
                long spread = 0, filled = 0, outside = 0;
                for (std::size_t i = 0; i < got.size(); ++i) {
                    spread += !std::isnan(stored[i]) && std::isnan(got[i]);
                    filled += std::isnan(stored[i]) && !std::isnan(got[i]);
                    outside += !std::isnan(got[i]) && !in_range(got[i]);
                }
                INFO(text(camera, options));
                CHECK(spread == 0);
                CHECK(filled == 0);
                CHECK(outside == 0);
            }
        }
    }
}

TEST_CASE("stability: ssao with a radius of less than a pixel is 1", "[ssao][stability]") {
    for (const Camera& camera : cameras(95, 71)) {
        const auto stored = scene::render(scene::room(), camera).stored;
        for (const Quality quality : qualities) {
            for (const double thickness : thicknesses) {
                for (const double radius : {0.005, 1e-5, 1e-12}) { // a pixel is 0.011 wide or more
                    const SsaoOptions options = options_of(radius, quality, thickness);
                    const auto got = visibility_of(stored, camera, options);
                    INFO(text(camera, options) << ", least " << *std::min_element(got.begin(), got.end()));
                    CHECK(std::all_of(got.begin(), got.end(), [](float v) { return v == 1; }));
                }
            }
        }
    }
}

TEST_CASE("stability: ssao with a radius of more than the image is finite", "[ssao][stability]") {
    for (const Camera& camera : cameras(95, 71)) {
        const auto stored = scene::render(scene::room(), camera).stored;
        const auto plane = scene::render({scene::Plane{{0, 0, -3}, {0.3, 0.2, 1}}}, camera).stored;
        for (const Quality quality : qualities) {
            for (const double thickness : thicknesses) {
                for (const double radius : {5.0, 30.0, 1e3, 1e6}) {
                    const SsaoOptions options = options_of(radius, quality, thickness);
                    INFO(text(camera, options));
                    const auto got = visibility_of(stored, camera, options);
                    CHECK(std::all_of(got.begin(), got.end(), in_range));
                    const auto open = visibility_of(plane, camera, options);
                    CHECK(*std::min_element(open.begin(), open.end()) >= 1 - plane_error);
                }
            }
        }
    }
}

TEST_CASE("stability: ssao of a lone plane in D16 and D24 at far/near of 1e6", "[ssao][stability]") {
    constexpr double near = 1e-3, far = 1e3;
    const Camera camera = camera_of(perspective(1.0, 4.0 / 3, {near, far}), 161, 121);
    std::printf("ssao of lone planes at far/near = 1e6: largest difference from 1\n");
    for (const double share : {0.001, 0.01, 0.1, 0.5, 0.9}) {
        for (const double tilt : {0.0, 30.0, 60.0}) {
            const double distance = share * far;
            const auto image = scene::render(
                {scene::Plane{{0, 0, -distance}, {std::sin(tilt * degree), 0, std::cos(tilt * degree)}}}, camera);
            for (const double radius : {0.05 * distance, 0.3 * distance}) {
                const auto worst_of = [](const std::vector<float>& got) {
                    double worst = 0;
                    for (const float v : got)
                        worst = std::isnan(v) ? 1 : std::max(worst, std::abs(static_cast<double>(v) - 1));
                    return worst;
                };
                for (const Quality quality : qualities) {
                    const SsaoOptions options = options_of(radius, quality, oracle::endless);
                    const double d16 =
                        worst_of(visibility_of(scene::codes16(image, camera), camera, options, Storage::uint16));
                    const double d24 =
                        worst_of(visibility_of(scene::codes24(image, camera), camera, options, Storage::uint24));
                    std::printf("  z %-4.4g tilt %-3.3g %-60s D16 %.4f, D24 %.4f\n", distance, tilt,
                                text(camera, options).c_str(), d16, d24);
                    INFO("z " << distance << ", tilt " << tilt << ", " << text(camera, options));
                    CHECK(d16 <= quantised_plane_error);
                    CHECK(d24 <= quantised_plane_error);
                }
            }
        }
    }
}

TEST_CASE("stability: ssao of a room in D16 and D24 keeps its occlusion", "[ssao][stability]") {
    const Camera camera = camera_of(perspective(1.0, 4.0 / 3, {0.5, 500}), 161, 121);
    const auto image = scene::render(scene::room(), camera);
    for (const Quality quality : qualities) {
        const SsaoOptions options = options_of(1, quality, oracle::endless);
        const auto exact = visibility_of(image.stored, camera, options);
        const auto off = [&](const std::vector<float>& got) {
            double sum = 0;
            for (std::size_t i = 0; i < got.size(); ++i)
                sum += std::pow(static_cast<double>(got[i] - exact[i]), 2);
            return std::sqrt(sum / static_cast<double>(got.size()));
        };
        INFO(text(camera, options));
        CHECK(std::count_if(exact.begin(), exact.end(), [](float v) { return v < 0.9f; }) > 5000);
        CHECK(off(visibility_of(scene::codes16(image, camera), camera, options, Storage::uint16)) <= 0.005);
        CHECK(off(visibility_of(scene::codes24(image, camera), camera, options, Storage::uint24)) <= 0.0005);
    }
}

TEST_CASE("stability: ssao of a plane at a grazing 85 degrees", "[ssao][stability]") {
    for (const double towards : {0.0, 1.2, 3.0}) {
        const auto plane = oracle::open_plane(85 * degree, towards);
        for (const auto& [name, camera] : oracle::views({.width = 161, .height = 121})) {
            const auto image = scene::render(plane.scene, camera);
            for (const Quality quality : qualities) {
                for (const double thickness : thicknesses) {
                    const SsaoOptions options = options_of(1, quality, thickness);
                    const auto got = visibility_of(image.stored, camera, options);
                    const float least = *std::min_element(got.begin(), got.end());
                    INFO(name << ", towards " << towards << ", " << text(camera, options) << ": least " << least);
                    CHECK(std::all_of(got.begin(), got.end(), in_range));
                    CHECK(least >= 1 - plane_error);
                }
            }
        }
    }
}
