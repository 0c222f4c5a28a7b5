// ssao against the scene itself, whose solids a depth image shows the front of only. What is left is mostly the thickness.

#include "brute_force.hpp"
#include "camera_over.hpp"
#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "scene/scene.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::images;

namespace {

Camera camera_of(const Projection& projection) {
    return camera_over(projection, 960, 540);
}

const Projection standing = perspective(0.9, 16.0 / 9, {0.1, 100});

} // namespace

TEST_CASE("ssao scene: the rays of a sample point give its visibility", "[ssao][oracle]") {
    const Camera camera = camera_of(standing);
    for (const char* name : {"room", "railings"}) {
        const scene::Scene scene = scene::named(name);
        const auto image = scene::render(scene, camera);
        const double radius = 0.05 * oracle::median_width(oracle::DepthLayer(camera, image.z));
        constexpr int few = 121;
        std::vector<oracle::Sample> exact = oracle::ray_traced(scene, camera, image, radius, oracle::sample_rays, few);
        const std::vector<oracle::Sample> points = exact;
        for (oracle::Sample& p : exact) {
            const auto at = static_cast<std::size_t>(p.y * camera.width + p.x);
            p.visibility = oracle::visibility(scene, image.position[at], image.normal[at], radius, 128);
        }
        std::size_t next = 0;
        const oracle::Off off =
            oracle::error_of(exact, [&](const oracle::Sample&) { return points[next++].visibility; });
        std::printf("rays of a sample point, %s: root of the mean square error %.5f, worst %.4f, %zu points\n", name,
                    off.rmse, off.worst, points.size());
        CHECK(points.size() > 20);
        CHECK(off.rmse <= oracle::sample_rays_error);
    }
}

TEST_CASE("ssao scene: what lies before the near plane blocks no ray", "[ssao][oracle]") {
    const auto above = [](double depth) { // a floor, 5 away, and a ceiling
        return scene::Scene{scene::Plane{{0, 0, -5}, {0, 0, 1}}, scene::Plane{{0, 0, -depth}, {0, 0, 1}}};
    };
    const Camera camera = camera_of(orthographic({-8, 8, -4.5, 4.5}, {4.5, 9}));
    const auto floor = scene::render(above(4), camera);
    for (const oracle::Sample& p : oracle::ray_traced(above(4), camera, floor, 3, 256, 200))
        CHECK(p.visibility == 1);
    for (const oracle::Sample& p : oracle::ray_traced(above(4.75), camera, floor, 3, 256, 200))
        CHECK(p.visibility < 0.02);
}

TEST_CASE("ssao scene: thickness from the silhouette halves the error of railings", "[ssao]") {
    const Camera camera = camera_of(standing);
    const scene::Scene scene = scene::railings();
    const auto image = scene::render(scene, camera);
    const double width = oracle::median_width(oracle::DepthLayer(camera, image.z));
    const StoredDepth stored{Image::from_host(oracle::device(), Element::f32, image.stored.data(), {960, 540}), camera};
    for (const double fraction : {0.05, 0.4}) {
        const auto points = oracle::ray_traced(scene, camera, image, fraction * width, oracle::sample_rays, 23);
        const auto rms = [&](const SsaoOptions& options) {
            const std::vector<float> got = floats(ssao(stored, fraction * width, options).visibility);
            return oracle::error_of(points,
                                    [&](const oracle::Sample& p) {
                                        return static_cast<double>(
                                            got[static_cast<std::size_t>(p.y * camera.width + p.x)]);
                                    })
                .rmse;
        };
        for (const Quality quality : {Quality::balanced, Quality::accurate}) {
            const double constant = rms({.sampling = Sampling{.quality = quality}});
            const double silhouette = rms({.sampling = Sampling{.quality = quality}, .thickness = Silhouette{}});
            std::printf(
                "railings against the scene itself, radius %.0f %% of the width: constant thickness %.4f, from the "
                "silhouette %.4f\n",
                100 * fraction, constant, silhouette);
            CHECK(silhouette <= constant / 2);
        }
    }
}
