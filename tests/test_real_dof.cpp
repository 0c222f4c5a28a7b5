// The blur of Blender's sharp frame against the path tracer's own through the same lens, nothing tuned to the image. For
// comparison: untouched 25.9 dB over the frame and 21.6 near edges of depth, Blender's Defocus node 35.2 and 30.6, or 36.1 and
// 31.7 tuned to the truth, a gather with the centre's circle 35.9 and 31.2; the noise of the truth 48.4 and 45.3.

#include "io_files.hpp"
#include "real_inputs.hpp"

#include <fathom/fathom.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>
#include <fathom/relative.hpp>

#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <vector>

using namespace fathom;
using namespace fathom::real;

namespace {

constexpr double least_balanced = 39.0, least_balanced_near_edges = 34.5;
constexpr double least_accurate = 40.3, least_accurate_near_edges = 35.9;

struct Frame {
    int width, height;
    std::vector<float> values; // red, green, blue

    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }
};

Frame read_frame(const fs::path& file) {
    Frame frame{};
    for (int c = 0; c < 3; ++c) {
        const char* const names[] = {"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"};
        cv::Mat channel;
        read_depth(file, {.channel = names[c]}).values.convertTo(channel, CV_32F);
        frame.width = channel.cols;
        frame.height = channel.rows;
        frame.values.resize(3 * channel.total());
        for (int y = 0; y < channel.rows; ++y)
            for (int x = 0; x < channel.cols; ++x)
                frame.values[3 * frame.index(x, y) + static_cast<std::size_t>(c)] = channel.at<float>(y, x);
    }
    return frame;
}

// Blender's frame: its depth, what the path tracer makes of it through the lens, and that lens.
struct BlenderFrame {
    fs::path folder;
    cv::Mat depth;
    Frame truth;
    Camera camera;
    CircleOfConfusion circle;
};

BlenderFrame blender_frame() {
    const fs::path folder = data / "blender" / "perspective";
    const cv::Mat depth = read_depth(folder / "sharp.exr").values;
    const CameraFile file = read_camera(folder / "camera.json");
    const Camera camera = camera_for(file, depth.cols, depth.rows);
    return {folder, depth, read_frame(folder / "dof.exr"), camera,
            circle_of_confusion({.f_number = file.lens.f_stop.value(),
                                 .focus = file.lens.focus_distance.value(),
                                 .focal_length_mm = file.lens.lens_mm,
                                 .sensor_width_mm = file.lens.sensor_mm},
                                camera)};
}

// Pixels within 12 of two neighbours of which one is more than 5 % farther away.
std::vector<char> near_edges(const cv::Mat& depth) {
    constexpr int reach = 12;
    cv::Mat edges = cv::Mat::zeros(depth.size(), CV_8U);
    const auto mark = [&](int x, int y, int dx, int dy) {
        if (x + dx >= depth.cols || y + dy >= depth.rows)
            return;
        const float a = depth.at<float>(y, x), b = depth.at<float>(y + dy, x + dx);
        if (std::abs(a - b) > 0.05f * std::min(a, b))
            edges.at<uchar>(y, x) = edges.at<uchar>(y + dy, x + dx) = 1;
    };
    for (int y = 0; y < depth.rows; ++y) {
        for (int x = 0; x < depth.cols; ++x) {
            mark(x, y, 1, 0);
            mark(x, y, 0, 1);
        }
    }
    std::vector<char> near(depth.total());
    for (int y = 0; y < depth.rows; ++y)
        for (int x = 0; x < depth.cols; ++x)
            for (int dy = -reach; dy <= reach && edges.at<uchar>(y, x); ++dy)
                for (int dx = -reach; dx <= reach; ++dx)
                    if (dx * dx + dy * dy <= reach * reach && y + dy >= 0 && y + dy < depth.rows && x + dx >= 0 &&
                        x + dx < depth.cols)
                        near[static_cast<std::size_t>((y + dy) * depth.cols + x + dx)] = 1;
    return near;
}

double psnr(const std::vector<float>& got, const std::vector<float>& truth, const std::vector<char>* only) {
    double sum = 0;
    long count = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (only && !(*only)[i / 3])
            continue;
        const double off =
            static_cast<double>(std::clamp(got[i], 0.0f, 1.0f)) - static_cast<double>(std::clamp(truth[i], 0.0f, 1.0f));
        REQUIRE(std::isfinite(off));
        sum += off * off;
        ++count;
    }
    return -10 * std::log10(sum / static_cast<double>(count));
}

} // namespace

TEST_CASE("real: the blur of Blender's frame against the path tracer's", "[dof][real]") {
    if (!there("blender/perspective"))
        return;
    const auto [folder, depth, truth, camera, circle] = blender_frame();
    const Frame sharp = read_frame(folder / "sharp.exr");
    const Device device = Device::open("cpu");
    const Image stored = Image::from_host(device, Element::f32, depth.data, {depth.cols, depth.rows});
    const Image color = Image::from_host(device, Element::f32, sharp.values.data(), {depth.cols, depth.rows, 3});
    const std::vector<char> near = near_edges(depth);
    const double untouched = psnr(sharp.values, truth.values, nullptr);
    const double untouched_near = psnr(sharp.values, truth.values, &near);
    std::cout << "blur, Blender perspective, dB over the frame and near edges: untouched " << untouched << " and "
              << untouched_near;
    CHECK(std::abs(untouched - 25.9) < 0.05); // the same pixels as in the figures above
    CHECK(std::abs(untouched_near - 21.6) < 0.05);
    for (const Quality quality : {Quality::balanced, Quality::fast, Quality::accurate}) {
        std::vector<float> got(sharp.values.size());
        dof({stored, camera}, color, circle, {.quality = quality}).download(got.data());
        const double whole = psnr(got, truth.values, nullptr), at_edges = psnr(got, truth.values, &near);
        std::cout << (quality == Quality::fast       ? "; fast "
                      : quality == Quality::balanced ? "; balanced "
                                                     : "; accurate ")
                  << whole << " and " << at_edges;
        const bool accurate = quality == Quality::accurate;
        CHECK(whole >= (accurate ? least_accurate : least_balanced));
        CHECK(at_edges >= (accurate ? least_accurate_near_edges : least_balanced_near_edges));
    }
    std::cout << '\n';
}

TEST_CASE("real: a photograph with relative depth is blurred as with the frame's own depth", "[dof][relative][real]") {
    if (!there("blender/perspective"))
        return;
    const auto [folder, depth, truth, camera, lens] = blender_frame();
    const test::TempFolder scratch;
    // The frame as a photograph: sRGB, 8 bits, JPEG of quality 98.
    Picture photo = read_picture(folder / "sharp.exr", {.layer = "ViewLayer.Combined"});
    cv::Mat bgr(photo.color.size(), CV_32FC3); // without the alpha
    const int pairs[] = {0, 0, 1, 1, 2, 2};
    cv::mixChannels(&photo.color, 1, &bgr, 1, pairs, 3);
    photo.color = bgr;
    photo.format = {.encoding = ColorEncoding::srgb, .bits = 8};
    write_picture(scratch / "photo.png", photo);
    cv::imwrite((scratch / "photo.jpg").string(), cv::imread((scratch / "photo.png").string()),
                {cv::IMWRITE_JPEG_QUALITY, 98});

    // 1/z from 0 to 1, and the blur that belongs to it: the lens's circle is k - g/z.
    cv::Mat inverse;
    cv::divide(1.0, depth, inverse);
    double least, most;
    cv::minMaxLoc(inverse, &least, &most);
    const cv::Mat relative = (inverse - least) / (most - least);
    for (const auto& [name, type, scale] : {std::tuple{"depth16.png", CV_16U, 65535.0}, {"depth8.png", CV_8U, 255.0}}) {
        cv::Mat codes;
        relative.convertTo(codes, type, scale);
        cv::imwrite((scratch / name).string(), codes);
    }
    const double blur = static_cast<double>(lens.g) * (most - least);
    const double focus = (static_cast<double>(lens.k / lens.g) - least) / (most - least);

    const Device device = Device::open("cpu");
    const auto figure = [&, &depth = depth, &truth = truth](const StoredDepth& stored, const CircleOfConfusion& circle,
                                                            double peak) {
        Picture light = read_picture(scratch / "photo.jpg");
        restore_highlights(light, peak);
        const Image color = Image::from_host(device, Element::f32, light.color.data, {depth.cols, depth.rows, 3});
        std::vector<float> bgr(3 * depth.total());
        dof(stored, color, circle, {.quality = Quality::balanced}).download(bgr.data());
        for (std::size_t i = 0; i < bgr.size(); i += 3)
            std::swap(bgr[i], bgr[i + 2]);
        return psnr(bgr, truth.values, nullptr);
    };
    const StoredDepth own{Image::from_host(device, Element::f32, depth.data, {depth.cols, depth.rows}), camera};
    const double exact = figure(own, lens, 1);
    std::cout << "blur, Blender's frame as a JPEG, dB over the frame: with its own depth " << exact;
    for (const char* name : {"depth16.png", "depth8.png"}) {
        RelativeFile read = read_relative(scratch / name);
        if (read.bits == 8)
            smooth_steps({read.values.ptr<float>(), read.values.total()}, depth.cols, depth.rows, 1 / 255.0);
        const StoredDepth stored{Image::from_host(device, Element::f32, read.values.data, {depth.cols, depth.rows}),
                                 relative_camera(depth.cols, depth.rows, RelativeOrder::high_is_near)};
        const double got = figure(stored, relative_circle(blur, focus, RelativeOrder::high_is_near), 1);
        std::cout << "; relative, " << read.bits << " bits " << got;
        CHECK(std::abs(got - exact) <= 0.3);
    }
    for (const double peak : {1.05, 1.1, 1.2})
        std::cout << "; whites " << peak << " times as bright " << figure(own, lens, peak);
    std::cout << '\n';
    CHECK(figure(own, lens, 1.05) > exact);
}
