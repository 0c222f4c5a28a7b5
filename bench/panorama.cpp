// fathom_bench_panorama: the time of ssao of a panorama beside that of pinholes with the same angle a pixel, which have to be rendered
// for it.

#include "scene/scene.hpp"

#include <fathom/fathom.hpp>
#include <fathom/pixel_rays.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <list>
#include <numbers>
#include <optional>
#include <vector>

using namespace fathom;
using Eigen::Vector3d;

namespace {

constexpr int rounds = 15;

scene::Rendered seen_by(const Camera& camera) {
    const PixelRays rays(camera);
    return scene::render(scene::room(), camera, [&](double x, double y) { return rays.ray_of(x, y); });
}

double milliseconds(const std::function<void()>& work) {
    std::vector<double> times;
    for (int i = 0; i < rounds; ++i) {
        const auto start = std::chrono::steady_clock::now();
        work();
        times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    std::ranges::nth_element(times, times.begin() + rounds / 2);
    return times[rounds / 2];
}

// Depth, and the part of it that has results.
struct Views {
    const char* name;
    std::vector<StoredDepth> depths;
    std::optional<Region> region;
};

void run() {
    constexpr int columns = 2048, rows = columns / 2;
    constexpr double focal = columns / (2 * std::numbers::pi);
    constexpr int wide = 1398, side = 652; // pixels of 130 and 90 degrees
    static_assert(side < 2 * focal + 1 && side > 2 * focal - 1);
    const Device device = Device::open("cpu");
    const auto pinhole = [](int across, int down) {
        Camera camera;
        camera.width = across;
        camera.height = down;
        camera.encoding = Encoding::view_z;
        camera.projection = perspective(Intrinsics{focal, focal, across / 2.0, down / 2.0, across, down},
                                        DepthSpan{0.1, 1000}, {.view_axes = ViewAxes::opengl});
        return camera;
    };
    std::list<std::vector<float>> seen; // which the images share
    const auto stored = [&](const Camera& camera, const scene::Rendered& rendered) {
        seen.push_back(rendered.stored);
        return StoredDepth{Image::from_host(device, Element::f32, seen.back().data(), {camera.width, camera.height}),
                           camera};
    };
    Camera panorama = pinhole(columns, rows);
    panorama.encoding = Encoding::ray_distance;
    panorama.lens = LensModel{LensLaw::equirectangular, focal, focal, columns / 2.0, rows / 2.0};
    const Camera one = pinhole(columns, rows), small = pinhole(side, side);
    constexpr int inner = (wide - side) / 2;
    Views all[] = {{"the panorama", {stored(panorama, seen_by(panorama))}, {}},
                   {"one pinhole of as many pixels", {stored(one, scene::render(scene::room(), one))}, {}},
                   {"six pinholes of 90 degrees, with steps where they meet", {}, {}},
                   {"six of 130 degrees, for the 90 in their middles", {}, Region{inner, inner, side, side}}};
    for (const Eigen::Matrix3d& turn : scene::cube_turns()) {
        Camera camera = pinhole(wide, wide);
        camera.view = Eigen::Matrix4d::Identity();
        camera.view->topLeftCorner<3, 3>() = turn;
        const StoredDepth depth = stored(camera, scene::render(scene::room(), camera));
        all[3].depths.push_back(depth);
        all[2].depths.push_back({depth.image.region(inner, inner, side, side), small});
    }
    constexpr std::pair<const char*, Quality> qualities[] = {
        {"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}};
    for (const double radius : {0.1, 0.4})
        for (const auto& [name, quality] : qualities) {
            double of_panorama = 0;
            for (const Views& views : all) {
                SsaoOptions options{.sampling = Sampling{.quality = quality}};
                options.region = views.region;
                const Image& first = views.depths[0].image;
                const Image visibility(device, Element::f32,
                                       views.region ? Layout{side, side} : Layout{first.width(), first.height()});
                const auto work = [&] {
                    for (const StoredDepth& depth : views.depths)
                        ssao(depth, {.visibility = visibility, .bent_normal = {}, .confidence = {}}, radius, options);
                    device.finish();
                };
                work(); // builds kernels
                const double time = milliseconds(work);
                if (of_panorama == 0)
                    of_panorama = time;
                std::printf("ssao %-8s radius %.1f  %-55s %7.2f ms, the panorama takes %.2f times that\n", name, radius,
                            views.name, time, of_panorama / time);
            }
        }
}

} // namespace

int main() {
    try {
        run();
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_bench_panorama: %s\n", error.what());
        return 1;
    }
}
