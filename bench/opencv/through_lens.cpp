// fathom_bench_lens: points, normals and occlusion of depth through a distorted lens: in the distorted image itself, and what people
// do with OpenCV: remap to a pinhole first, or undistort the pixels once and multiply their rays. Errors against the scene, and times.

#include "brute_force.hpp"
#include "sweeps.hpp"

#include <fathom/fathom.hpp>
#include <fathom/pixel_rays.hpp>

#include <Eigen/Geometry>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/rgbd/depth.hpp>

#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace fathom;
using namespace fathom::bench;
using Eigen::Vector3d;

namespace {

constexpr double focal = 0.63; // of the width
constexpr double radius = 0.4;
const std::vector<double> k{-0.35, 0.13, 0, 0, 0.01};

// The room as a camera sees it.
struct Seen {
    Camera camera;
    scene::Rendered image;
    std::vector<oracle::Sample> visibility;

    Seen(int width, int height, bool distorted) {
        const double f = focal * width, cx = 0.5 * width, cy = 0.5 * height;
        camera.width = width;
        camera.height = height;
        camera.encoding = Encoding::view_z;
        camera.projection =
            perspective(Intrinsics{f, f, cx, cy, width, height}, DepthSpan{0.1, 100}, {.view_axes = ViewAxes::opencv});
        if (distorted)
            camera.lens = LensModel{LensLaw::brown, f, f, cx, cy, k};
        const PixelRays rays(camera);
        image = scene::render(scene::room(), camera, [&](double x, double y) { return rays.ray_of(x, y); });
        visibility = oracle::ray_traced(scene::room(), camera, image, radius);
    }
};

// Of points: parts of the distance. Of normals: degrees, whichever side they show. Where either has none, the pixel is left out.
Deviation vectors_off(const cv::Mat& found, const scene::Rendered& truth, bool points) {
    std::vector<double> errors;
    for (int y = 0; y < found.rows; ++y)
        for (int x = 0; x < found.cols; ++x) {
            const auto i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(found.cols) + static_cast<std::size_t>(x);
            const auto& v = found.at<cv::Vec3f>(y, x);
            const Vector3d got(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
            const Vector3d& exact = points ? truth.position[i] : truth.normal[i];
            if (!got.allFinite() || got.isZero() || !exact.allFinite() || exact.isZero())
                continue;
            errors.push_back(points ? (got - exact).norm() / exact.norm()
                                    : std::atan2(got.cross(exact).norm(), std::abs(got.dot(exact))) * 180 /
                                          std::numbers::pi);
        }
    return summary(points ? "of the distance" : "degrees", errors);
}

Deviation visibility_off(const cv::Mat& found, const Seen& seen) {
    std::vector<double> errors;
    for (const oracle::Sample& p : seen.visibility)
        errors.push_back(static_cast<double>(found.at<float>(p.y, p.x)) - p.visibility);
    return summary("visibility", errors);
}

struct Way {
    const char* operation;
    std::string name;
    const char* kind;
    std::function<void()> run;
    std::function<Deviation()> error;
};

// What the ways read and write.
struct Frame {
    const Device& device;
    Seen bent, straight;
    cv::Mat depth, remapped, points, normals, visibility, matrix, across, down, rays;
    cv::Ptr<cv::rgbd::RgbdNormals> fals;

    Frame(const Device& on, int width, int height)
        : device(on), bent(width, height, true), straight(width, height, false),
          depth(height, width, CV_32F, bent.image.stored.data()), remapped(height, width, CV_32F),
          points(height, width, CV_32FC3), normals(height, width, CV_32FC3), visibility(height, width, CV_32F) {
        const double f = focal * width;
        matrix = (cv::Mat_<double>(3, 3) << f, 0, 0.5 * width - 0.5, 0, f, 0.5 * height - 0.5, 0, 0, 1);
        cv::initUndistortRectifyMap(matrix, k, cv::Mat(), matrix, {width, height}, CV_32FC1, across, down);
        cv::Mat pixels(height, width, CV_32FC2);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                pixels.at<cv::Vec2f>(y, x) = {static_cast<float>(x), static_cast<float>(y)};
        cv::undistortPoints(pixels.reshape(2, 1), rays, matrix, k);
        rays = rays.reshape(2, height);
        fals = cv::rgbd::RgbdNormals::create(height, width, CV_32F, cv::Mat_<float>(matrix), 5,
                                             cv::rgbd::RgbdNormals::RGBD_NORMALS_METHOD_FALS);
    }

    Image image_of(const cv::Mat& of) const {
        return Image::from_host(device, Element::f32, of.data, {of.cols, of.rows, of.channels()});
    }
    StoredDepth stored(const cv::Mat& of, const Seen& seen) const { return {image_of(of), seen.camera}; }
};

// Results on a device that does not share the host's memory come back with `image`.
Deviation after(Frame& f, const cv::Mat& result, const std::function<Deviation()>& off) {
    f.device.finish();
    f.image_of(result).download(result.data);
    return off();
}

std::vector<Way> ways(Frame& f) {
    std::vector<Way> list{
        {"unproject", "fathom", "library", [&] { unproject(f.stored(f.depth, f.bent), f.image_of(f.points)); },
         [&] { return after(f, f.points, [&] { return vectors_off(f.points, f.bent.image, true); }); }},
        {"unproject", "undistortPoints once, its rays", "opencv",
         [&] {
             std::vector<cv::Mat> parts;
             cv::split(f.rays, parts);
             cv::multiply(parts[0], f.depth, parts[0]);
             cv::multiply(parts[1], f.depth, parts[1]);
             parts.push_back(f.depth);
             cv::merge(parts, f.points);
         },
         [&] { return vectors_off(f.points, f.bent.image, true); }},
        {"normals", "fathom", "library", [&] { normals(f.stored(f.depth, f.bent), f.image_of(f.normals)); },
         [&] { return after(f, f.normals, [&] { return vectors_off(f.normals, f.bent.image, false); }); }}};
    for (const auto& [name, way] : {std::pair{"nearest", cv::INTER_NEAREST}, {"linear", cv::INTER_LINEAR}}) {
        const auto remap = [&f, way = way] { cv::remap(f.depth, f.remapped, f.across, f.down, way); };
        const std::string remapped = std::string("remap ") + name;
        list.push_back({"unproject", remapped + ", depthTo3d", "opencv",
                        [&f, remap] {
                            remap();
                            cv::rgbd::depthTo3d(f.remapped, f.matrix, f.points);
                        },
                        [&f] { return vectors_off(f.points, f.straight.image, true); }});
        list.push_back({"normals", remapped + ", FALS", "opencv",
                        [&f, remap] {
                            remap();
                            cv::rgbd::depthTo3d(f.remapped, f.matrix, f.points);
                            (*f.fals)(f.points, f.normals);
                        },
                        [&f] { return vectors_off(f.normals, f.straight.image, false); }});
        list.push_back(
            {"ssao", remapped + ", balanced", "opencv",
             [&f, remap] {
                 remap();
                 ssao(f.stored(f.remapped, f.straight), {f.image_of(f.visibility), {}, {}}, radius,
                      {.sampling = Sampling{.quality = Quality::balanced}});
             },
             [&f] { return after(f, f.visibility, [&] { return visibility_off(f.visibility, f.straight); }); }});
    }
    for (const auto& [name, quality] : {std::pair{"fast", Quality::fast}, {"balanced", Quality::balanced}})
        list.push_back({"ssao", std::string("fathom, ") + name, "library",
                        [&f, quality = quality] {
                            ssao(f.stored(f.depth, f.bent), {f.image_of(f.visibility), {}, {}}, radius,
                                 {.sampling = Sampling{.quality = quality}});
                        },
                        [&f] { return after(f, f.visibility, [&] { return visibility_off(f.visibility, f.bent); }); }});
    return list;
}

std::vector<Figures> figures(const Device& device, int width, int height, const Effort& effort) {
    Frame frame(device, width, height);
    const std::vector<Way> list = ways(frame);
    std::vector<Figures> rows;
    std::vector<Work> work;
    for (const Way& way : list) {
        work.push_back({.run = way.run});
        work.back().every = rounds_between(device, work.back(), effort.rounds, effort.seconds);
        rows.push_back({way.operation, way.name, way.kind, "float32", "room through brown", width, height});
        rows.back().error = way.error();
    }
    const auto seconds = measured(device, work, effort.rounds, effort.clock);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        rows[i].seconds = seconds[i];
        print_row(rows[i]);
    }
    return rows;
}

constexpr const char* help =
    "usage: fathom_bench_lens [--size WxH] [--rounds N] [--seconds S] [--processor-time] [--csv FILE]\n"
    "Points, normals and occlusion through a distorted lens beside OpenCV's ways, on the CPU: errors and times at WxH "
    "(1920x1080).\n"
    "Options as those of fathom_bench.\n";

} // namespace

int main(int argc, char** argv) {
    Comparison asked;
    if (const auto status = asked.read(argc, argv, help))
        return *status;
    try {
        const Device device = Device::open("cpu");
        const auto rows = figures(device, asked.width, asked.height, asked.effort);
        if (!asked.csv.empty())
            table_of(device, rows, asked.effort.clock).write_csv(asked.csv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_bench_lens: %s\n", error.what());
        return 1;
    }
    return 0;
}
