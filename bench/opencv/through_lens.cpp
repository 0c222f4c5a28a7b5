// fathom_bench_lens: points and normals of depth through a distorted lens: in the distorted image itself, and what people do with
// OpenCV: remap to a pinhole first, or undistort the pixels once and multiply their rays. Errors against the scene, and times.
// Then the time of ssao of a panorama beside that of pinholes with the same angle a pixel, which have to be rendered for it.

#include "scene/scene.hpp"

#include <fathom/fathom.hpp>
#include <fathom/pixel_rays.hpp>

#include <Eigen/Geometry>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/rgbd/depth.hpp>

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

constexpr int width = 1920, height = 1080, rounds = 15;
constexpr double f = 1210, cx = 959.5, cy = 539.5; // as OpenCV counts them
const std::vector<double> k{-0.35, 0.13, 0, 0, 0.01};

Camera camera_of(bool distorted) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.encoding = Encoding::view_z;
    camera.projection = perspective(Intrinsics{f, f, cx + 0.5, cy + 0.5, width, height}, DepthSpan{0.1, 100},
                                    {.view_axes = ViewAxes::opencv});
    if (distorted)
        camera.lens = LensModel{LensLaw::brown, f, f, cx + 0.5, cy + 0.5, k};
    return camera;
}

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

struct Off {
    double mean = 0, largest = 0;
};

// Of points: parts of the distance. Of normals: degrees, whichever side they show. Where either has none, the pixel is left out.
Off off_by(const cv::Mat& found, const scene::Rendered& truth, bool points) {
    Off off;
    long count = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
            const auto& v = found.at<cv::Vec3f>(y, x);
            const Vector3d got(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
            const Vector3d& exact = points ? truth.position[i] : truth.normal[i];
            if (!got.allFinite() || got.isZero() || !exact.allFinite() || exact.isZero())
                continue;
            const double here =
                points ? (got - exact).norm() / exact.norm()
                       : std::atan2(got.cross(exact).norm(), std::abs(got.dot(exact))) * 180 / std::numbers::pi;
            off.mean += here;
            off.largest = std::max(off.largest, here);
            ++count;
        }
    off.mean /= static_cast<double>(count);
    return off;
}

void print(const char* what, const char* how, const Off& off, double time) {
    std::printf("%-8s %-58s mean %9.3g  largest %9.3g  %7.2f ms\n", what, how, off.mean, off.largest, time);
}

void run() {
    const Device device = Device::open("cpu");
    const Camera lens = camera_of(true);
    const scene::Rendered bent = seen_by(lens), straight = seen_by(camera_of(false));
    const cv::Mat depth(height, width, CV_32F, const_cast<float*>(bent.stored.data()));
    const cv::Mat matrix = (cv::Mat_<double>(3, 3) << f, 0, cx, 0, f, cy, 0, 0, 1);
    cv::Mat result(height, width, CV_32FC3);

    const auto own = [&](const char* what, const char* how, const auto& operation, bool points) {
        const StoredDepth stored{Image::from_host(device, Element::f32, depth.data, {width, height}), lens};
        const Image image = Image::from_host(device, Element::f32, result.data, {width, height, 3});
        operation(stored, image); // builds kernels
        const double time = milliseconds([&] {
            operation(stored, image);
            device.finish();
        });
        image.download(result.data);
        print(what, how, off_by(result, bent, points), time);
    };
    own(
        "points", "fathom, in the distorted image",
        [](const StoredDepth& stored, const Image& image) { unproject(stored, image); }, true);

    std::vector<cv::Point2f> pixels, rays;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            pixels.emplace_back(static_cast<float>(x), static_cast<float>(y));
    cv::undistortPoints(pixels, rays, matrix, k);
    const cv::Mat kept(height, width, CV_32FC2, rays.data());
    cv::Mat points;
    double time = milliseconds([&] {
        std::vector<cv::Mat> parts;
        cv::split(kept, parts);
        cv::multiply(parts[0], depth, parts[0]);
        cv::multiply(parts[1], depth, parts[1]);
        parts.push_back(depth);
        cv::merge(parts, points);
    });
    print("points", "OpenCV, undistortPoints once, its rays times the depth", off_by(points, bent, true), time);

    cv::Mat across, down, remapped, normals_of;
    cv::initUndistortRectifyMap(matrix, k, cv::Mat(), matrix, {width, height}, CV_32FC1, across, down);
    const std::pair<const char*, int> ways[] = {{"nearest", cv::INTER_NEAREST}, {"linear", cv::INTER_LINEAR}};
    for (const auto& [name, way] : ways) {
        time = milliseconds([&, way = way] {
            cv::remap(depth, remapped, across, down, way);
            cv::rgbd::depthTo3d(remapped, matrix, points);
        });
        print("points", (std::string("OpenCV, remap, ") + name + ", and depthTo3d").c_str(),
              off_by(points, straight, true), time);
    }

    own(
        "normals", "fathom, in the distorted image",
        [](const StoredDepth& stored, const Image& image) { normals(stored, image); }, false);
    const auto computer = cv::rgbd::RgbdNormals::create(height, width, CV_32F, cv::Mat_<float>(matrix), 5,
                                                        cv::rgbd::RgbdNormals::RGBD_NORMALS_METHOD_FALS);
    for (const auto& [name, way] : ways) {
        time = milliseconds([&, way = way] {
            cv::remap(depth, remapped, across, down, way);
            cv::rgbd::depthTo3d(remapped, matrix, points);
            (*computer)(points, normals_of);
        });
        print("normals", (std::string("OpenCV, remap, ") + name + ", depthTo3d and FALS").c_str(),
              off_by(normals_of, straight, false), time);
    }
}

// Depth, and the part of it that has results.
struct Views {
    const char* name;
    std::vector<StoredDepth> depths;
    std::optional<Region> region;
};

void run_panorama() {
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
    for (const auto& [axis, angle] : {std::pair{Vector3d::UnitY(), 0.0},
                                      {Vector3d::UnitY(), 90.0},
                                      {Vector3d::UnitY(), 180.0},
                                      {Vector3d::UnitY(), 270.0},
                                      {Vector3d::UnitX(), 90.0},
                                      {Vector3d::UnitX(), 270.0}}) {
        Camera camera = pinhole(wide, wide);
        camera.view = Eigen::Matrix4d::Identity();
        camera.view->topLeftCorner<3, 3>() = Eigen::AngleAxisd(angle * std::numbers::pi / 180, axis).toRotationMatrix();
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
        run_panorama();
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_bench_lens: %s\n", error.what());
        return 1;
    }
}
