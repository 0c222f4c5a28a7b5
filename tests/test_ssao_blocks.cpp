// Which blocks of 64 x 64 pixels a quality of ssao computes at half resolution: radii are long there, thin bars and low steps keep
// all pixels, and no block pops while the camera moves.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "scene/scene.hpp"
#include "ssao_call.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::images;

namespace {

constexpr int width = 400, height = 300, block = 64, seam = 10;
// As src/operations/ssao/ssao_method.cpp has them.
struct HalfResolution {
    int slices, samples, jitter;
    double growth;
};
constexpr HalfResolution half_resolution[] = {{1, 22, 16, 2.3}, {2, 26, 16, 3}, {3, 66, 16, 2}};

std::size_t index(int x, int y, int row = width) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(row) + static_cast<std::size_t>(x);
}

Camera perspective_camera() {
    return {.projection = perspective(1.0, 1.0 * width / height, {0.5, 500}), .width = width, .height = height};
}

Camera orthographic_camera() {
    Camera camera = perspective_camera();
    const double y = 1.95, x = y * width / height;
    camera.projection = orthographic({-x, x, -y, y}, {0.5, 500});
    return camera;
}

SsaoCall whole(Quality quality, double radius) {
    SsaoCall call = options_of(radius, quality);
    sampling_of(call).half_resolution = false;
    return call;
}

SsaoCall half(Quality quality, double radius) {
    SsaoCall call = options_of(radius, quality);
    sampling_of(call).half_resolution = true;
    const auto& [slices, samples, jitter, growth] = half_resolution[static_cast<int>(quality)];
    sampling_of(call).slices = slices, sampling_of(call).samples = samples;
    sampling_of(call).jitter = jitter, sampling_of(call).growth = growth;
    return call;
}

/// A floor before a wall, and a box on it: far and near, smooth and with edges.
std::vector<float> yard(const Camera& camera, double forward = 0) {
    return scene::render({scene::Plane{{0, -1.5, 0}, {0, 1, 0}}, scene::Plane{{0, 0, -14 + forward}, {0.1, 0, 1}},
                          scene::Box{{-1.5, -1, -6 + forward}, {0.7, 0.6, 0.7}}},
                         camera)
        .stored;
}

// 39 to 200 pixels, 104 to 530 and 53 to 270: the qualities ask for 48, 128 and 64.
double yard_radius(Quality quality) {
    constexpr double of_quality[] = {2, 5.3, 2.7};
    return of_quality[static_cast<int>(quality)];
}

/// Pixels that have the bits of both, of one only, and of neither.
struct Kinds {
    long whole = 0, half = 0, neither = 0;
};
Kinds kinds_of(const std::vector<float>& got, const std::vector<float>& all, const std::vector<float>& few) {
    Kinds kinds;
    for (std::size_t i = 0; i < got.size(); ++i) {
        const bool as_all = same_bits(got[i], all[i]), as_few = same_bits(got[i], few[i]);
        kinds.whole += as_all && !as_few;
        kinds.half += as_few && !as_all;
        kinds.neither += !as_all && !as_few;
    }
    return kinds;
}

} // namespace

TEST_CASE(
    "ssao in blocks: near surfaces have half resolution, far ones all pixels, and nothing else comes between them",
    "[ssao][blocks]") {
    const Camera camera = perspective_camera();
    const std::vector<float> values = yard(camera);
    const StoredDepth stored = stored_of(values, camera);
    for (const Quality quality : qualities) {
        const auto got = visibility_of(stored, options_of(yard_radius(quality), quality));
        const auto all = visibility_of(stored, whole(quality, yard_radius(quality)));
        const auto few = visibility_of(stored, half(quality, yard_radius(quality)));
        const Kinds kinds = kinds_of(got, all, few);
        INFO(quality_names[static_cast<int>(quality)]);
        std::printf("ssao in blocks, %s: %ld pixels of all, %ld of half resolution, %ld between them\n",
                    quality_names[static_cast<int>(quality)], kinds.whole, kinds.half, kinds.neither);
        CHECK(kinds.whole > 1000);
        CHECK(kinds.half > 1000);
        double worst = 0; // beyond the two results, and beyond the steepest passage from one to the other
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const auto at = [&](const std::vector<float>& of, int dx, int dy) {
                    return static_cast<double>(of[index(x + dx, y + dy)]);
                };
                const double least = std::min(at(all, 0, 0), at(few, 0, 0)),
                             greatest = std::max(at(all, 0, 0), at(few, 0, 0));
                worst = std::max({worst, least - at(got, 0, 0), at(got, 0, 0) - greatest});
                for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
                    if (x + dx >= width || y + dy >= height)
                        continue;
                    const auto step = [&](const std::vector<float>& of) { return at(of, dx, dy) - at(of, 0, 0); };
                    const double apart =
                        std::max(std::abs(at(few, 0, 0) - at(all, 0, 0)), std::abs(at(few, dx, dy) - at(all, dx, dy)));
                    const double most = std::max(std::abs(step(all)), std::abs(step(few))) + apart / 8;
                    worst = std::max(worst, std::abs(step(got)) - most);
                }
            }
        std::printf("  largest step beyond those of both, and an eighth of their difference: %.1e\n", worst);
        CHECK(worst <= 1e-6);
    }
}

TEST_CASE("ssao in blocks: orthographic radii are long everywhere or nowhere", "[ssao][blocks]") {
    const Camera camera = orthographic_camera(); // 77 pixels a unit
    const std::vector<float> values = yard(camera);
    const StoredDepth stored = stored_of(values, camera);
    for (const auto& [radius, is_half] : {std::pair{0.5, false}, {0.7, true}}) {
        const auto got = visibility_of(stored, options_of(radius, Quality::fast));
        CHECK(same_bits(got, visibility_of(stored, (is_half ? half : whole)(Quality::fast, radius))));
    }
}

namespace {

/// A wall with a crease; bars, or a step, stand before its left part. A unit covers 50 pixels and more.
std::vector<float> wall_with(const scene::Scene& more) {
    scene::Scene scene{scene::Plane{{0, -1, -4}, {0, 0.4, 1}}, scene::Plane{{0, -1, -4}, {0, 1, 0.1}}};
    scene.insert(scene.end(), more.begin(), more.end());
    return scene::render(scene, perspective_camera()).stored;
}

scene::Scene thin_bars() {
    scene::Scene bars;
    for (int i = 0; i < 9; ++i)
        bars.push_back(scene::Box{{-2 + 0.18 * i, 0, -3.4}, {0.009, 5, 0.009}}); // 2 pixels wide
    return bars;
}

scene::Scene low_step() {
    return {scene::Box{{-3, 0, -4}, {2.5, 5, 0.1}}};
}

} // namespace

TEST_CASE("ssao in blocks: thin bars and low steps keep all pixels", "[ssao][blocks]") {
    const Camera camera = perspective_camera();
    constexpr double radius = 2.6; // 130 pixels and more
    for (const auto& [what, more] : {std::pair{"bars", thin_bars()}, {"a step", low_step()}}) {
        const auto values = wall_with(more), bare = wall_with({});
        for (const Quality quality : {Quality::balanced, Quality::accurate}) {
            const StoredDepth stored = stored_of(values, camera);
            const auto got = visibility_of(stored, options_of(radius, quality));
            const auto all = visibility_of(stored, whole(quality, radius));
            const Kinds kinds = kinds_of(got, all, visibility_of(stored, half(quality, radius)));
            long differ = 0, beside = 0;
            for (int y = seam; y < height - seam; ++y)
                for (int x = 1; x < width - 1; ++x) {
                    const bool is_bar = values[index(x, y)] != bare[index(x, y)];
                    const bool is_edge = is_bar != (values[index(x + 1, y)] != bare[index(x + 1, y)]);
                    // In the last pixels of a block it may already pass over.
                    if (!is_edge || x % block < seam || x % block >= block - seam || y % block < seam ||
                        y % block >= block - seam)
                        continue;
                    ++beside;
                    differ += !same_bits(got[index(x, y)], all[index(x, y)]);
                }
            INFO(what << ", " << quality_names[static_cast<int>(quality)]);
            CHECK(beside > 50);
            CHECK(differ == 0);
            CHECK(kinds.half > 5000); // the bare part
        }
    }
}

TEST_CASE("ssao in blocks: numbers of slices, samples, growth and jitter keep all pixels", "[ssao][blocks]") {
    const Camera camera = perspective_camera();
    const std::vector<float> values = yard(camera);
    const StoredDepth stored = stored_of(values, camera);
    for (const bool without : {false, true}) {
        SsaoCall slices = options_of(yard_radius(Quality::fast), Quality::fast), samples = slices, growth = slices,
                 jitter = slices;
        sampling_of(slices).slices = 1, sampling_of(samples).samples = 6, sampling_of(jitter).jitter = 16;
        sampling_of(growth).growth = 1;
        const auto all = visibility_of(stored, whole(Quality::fast, yard_radius(Quality::fast)));
        for (SsaoCall* call : {&slices, &samples, &growth, &jitter}) {
            if (without)
                sampling_of(*call).half_resolution = false;
            CHECK(same_bits(visibility_of(stored, *call), all));
        }
    }
}

TEST_CASE("ssao: samples grow with the radius beyond 48 pixels, to as many as is said", "[ssao]") {
    const Camera camera = orthographic_camera(); // 77 pixels a unit
    const std::vector<float> values =
        scene::render({scene::Plane{{0, 0, -14}, {0.5, 0.3, 1}}, scene::Box{{0, 0, -14}, {0.7, 0.6, 0.7}, 0.5}}, camera)
            .stored;
    const StoredDepth stored = stored_of(values, camera);
    for (const bool half : {false, true}) {
        const auto with = [&](double radius, int samples, double growth) {
            SsaoCall call = options_of(radius, Quality::balanced);
            sampling_of(call).half_resolution = half;
            sampling_of(call).samples = samples, sampling_of(call).growth = growth;
            return visibility_of(stored, call);
        };
        const double few = half ? 1 : 0.5, many = half ? 4 : 2; // 38 and 154 pixels that are computed
        CHECK(same_bits(with(few, 10, 4), with(few, 10, 1)));
        CHECK(same_bits(with(many, 10, 1.5), with(many, 15, 1)));
        CHECK(!same_bits(with(many, 10, 4), with(many, 15, 1))); // 19, the root of 181 / 48 times as many
    }
}
