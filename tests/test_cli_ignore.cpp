// Pixels that do not count: --ignore, --ignore-below and --valid. The truth is the result without them, and NaN where a mask or a
// distance says so.
#include "exr_files.hpp"
#include "program.hpp"

#include <fmt/format.h>

using namespace fathom;
using namespace fathom::test;
using fathom::test::write;

namespace {

cv::Mat mask_of(double share = 0.3) {
    cv::Mat mask(height, width, CV_8UC1), random(height, width, CV_32FC1);
    cv::RNG(3).fill(random, cv::RNG::UNIFORM, 0, 1);
    cv::compare(random, share, mask, cv::CMP_LT);
    return mask;
}

/// The bits of a NaN may differ.
bool alike(const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() && std::equal(a.begin<float>(), a.end<float>(), b.begin<float>(), [](float x, float y) {
               return x == y || (std::isnan(x) && std::isnan(y));
           });
}

cv::Mat without(cv::Mat z, const cv::Mat& mask) {
    z = z.clone();
    z.setTo(std::numeric_limits<float>::quiet_NaN(), mask);
    return z;
}

/// An array of NumPy's bool.
void write_bools(const std::string& file, const cv::Mat& mask) {
    std::string header = "{'descr': '|b1', 'fortran_order': False, 'shape': (" + std::to_string(mask.rows) + ", " +
                         std::to_string(mask.cols) + "), }";
    header.resize(117, ' ');
    header += '\n';
    std::string bytes("\x93NUMPY\x01\x00", 8);
    bytes += {static_cast<char>(header.size()), 0};
    bytes += header;
    for (const uchar value : cv::Mat_<uchar>(mask))
        bytes += static_cast<char>(value != 0);
    write(file, bytes);
}

struct Scene {
    Folder folder;
    std::string camera = camera_file(folder), depth = depth_file(folder, "depth.exr"), out = folder / "out/z.exr";

    cv::Mat z(const std::string& input, const Arguments& more = {}) const {
        check_done(joined({"linearize", input, "--camera", camera, "-o", out}, more));
        return channel(out);
    }
    std::string saved(const std::string& name, const cv::Mat& image) const {
        REQUIRE(cv::imwrite(folder / name, image));
        return folder / name;
    }
};

} // namespace

TEST_CASE("ignore program: a mask of any type takes its pixels out, and leaves the bits of all others") {
    const Scene scene;
    const cv::Mat mask = mask_of(), expected = without(scene.z(scene.depth), mask);
    const cv::Mat colors = merged({mask, mask * 0, mask * 0});
    const std::string bools = scene.folder / "mask.npy", exr = scene.folder / "mask.exr";
    write_bools(bools, mask);
    write_image(exr, converted(mask, CV_32F, 0.001), {.channels = {"mask"}, .png_scale = {}});
    for (const std::string& file :
         {scene.saved("mask.png", mask), scene.saved("words.png", converted(mask, CV_16U, 0.004)),
          scene.saved("colors.png", colors), scene.saved("mask.tif", mask), bools, exr}) {
        INFO(file);
        CHECK(alike(scene.z(scene.depth, {"--ignore", file}), expected));
    }
    for (const char* name : {"a.png", "b.tif"}) { // integers, whose camera names no code
        const std::string integers = scene.saved(name, converted(ramp(), CV_16U, 65535));
        CHECK(alike(scene.z(integers, {"--ignore", scene.folder / "mask.png"}), without(scene.z(integers), mask)));
    }
    // Operations that look around see no more of them than of NaN in the file.
    const std::string holes = depth_file(scene.folder, "holes.exr", without(ramp(), mask));
    const auto normals = [&](const std::string& input, const Arguments& more) {
        check_done(joined({"normals", input, "--camera", scene.camera, "-o", scene.out}, more));
        return std::pair(channel(scene.out, "N.X"), channel(scene.out, "N.Z"));
    };
    CHECK(alike(normals(scene.depth, {"--ignore", exr}).first, normals(holes, {}).first));
    CHECK(alike(normals(scene.depth, {"--ignore", exr}).second, normals(holes, {}).second));
}

TEST_CASE("ignore program: an alpha or a confidence leaves out what is below a threshold") {
    const Scene scene;
    const cv::Mat confidence = filled<uchar>(width, height, [](int x, int y) { return (y * width + x) % 256; });
    const cv::Mat plain = scene.z(scene.depth);
    const auto left = [&](const std::string& file, const char* below) {
        return scene.z(scene.depth, {"--ignore", file, "--ignore-below", below});
    };
    const std::string grey = scene.saved("confidence.png", confidence);
    CHECK(alike(left(grey, "3"), without(plain, confidence < 3)));
    CHECK(alike(left(grey, "0.5"), without(plain, confidence < 127.5)));
    const cv::Mat picture = merged({confidence * 0, confidence * 0, confidence * 0, confidence});
    const std::string alpha = scene.saved("alpha.png", picture);
    CHECK(alike(left(alpha, "1"), without(plain, confidence < 255)));
    CHECK(alike(left(alpha, "0.25"), without(plain, confidence < 63.75)));
    const std::string exr = scene.folder / "rgba.exr";
    write_color(exr, converted(picture, CV_32F, 1 / 255.0));
    CHECK(alike(left(exr, "0.5"), without(plain, confidence < 127.5)));
    // Beyond the data window of a mask nothing is masked, and nothing has a confidence.
    write(fs::path(scene.folder / "part.exr"),
          ExrImage{.display = {{0, 0}, {width - 1, height - 1}}, .data = {{8, 4}, {27, 13}}});
    cv::Mat part = cv::Mat::zeros(height, width, CV_8UC1);
    part(cv::Rect(8, 4, 20, 10)) = 255;
    CHECK(alike(scene.z(scene.depth, {"--ignore", scene.folder / "part.exr"}), without(plain, part)));
    CHECK(alike(left(scene.folder / "part.exr", "0.5"), without(plain, part == 0)));
}

TEST_CASE("valid program: distances outside are invalid, bounds lie within, and the background stays") {
    const Scene scene;
    const cv::Mat plain = scene.z(scene.depth); // from 0.5 on, with a background pixel in the corner
    REQUIRE(std::isinf(plain.at<float>(height - 1, width - 1)));
    const float bound = plain.at<float>(20, 7);
    const auto valid = [&](double low, double high) {
        const cv::Mat inside = (plain >= low) & (plain <= high), background = plain == HUGE_VAL;
        return without(plain, ~(inside | background));
    };
    const std::string exact = fmt::format("{}", bound);
    CHECK(alike(scene.z(scene.depth, {"--valid", exact + ",2"}), valid(bound, 2)));
    CHECK(alike(scene.z(scene.depth, {"--valid", "0.6," + exact}), valid(0.6f, bound)));
    CHECK(alike(scene.z(scene.depth, {"--valid", "0.75,inf"}), valid(0.75, HUGE_VAL)));
    const cv::Mat mask = mask_of();
    CHECK(alike(scene.z(scene.depth, {"--valid", "0.75,1", "--ignore", scene.saved("mask.png", mask)}),
                without(valid(0.75, 1), mask)));
    const std::string integers = scene.saved("a.png", converted(ramp(), CV_16U, 65535));
    const cv::Mat of_integers = scene.z(integers);
    CHECK(alike(scene.z(integers, {"--valid", "0.75,1"}),
                without(of_integers, (of_integers < 0.75) | ((of_integers > 1) & (of_integers < HUGE_VAL)))));
}

TEST_CASE("ignore program: relative depth has neither the values nor the range of what does not count") {
    const Scene scene;
    cv::Mat values = ramp() * 5, mask = cv::Mat::zeros(height, width, CV_8UC1);
    mask(cv::Rect(3, 3, 9, 9)) = 1;
    const Arguments masks{"dof-masks",  "--relative", "high-is-near", "--blur-px", "20",
                          "--focus-at", "30,20",      "-o",           scene.out};
    const std::string holes = depth_file(scene.folder, "holes.exr", without(values, mask));
    check_done(joined(masks, {holes}));
    const cv::Mat expected = channel(scene.out, "coc");
    values.setTo(-999, mask);
    check_done(joined(masks, {depth_file(scene.folder, "junk.exr", values), "--ignore", scene.saved("m.png", mask)}));
    CHECK(alike(channel(scene.out, "coc"), expected));
}

TEST_CASE("ignore program: what is wrong is told in one line, with the cure") {
    const Scene scene;
    const auto refused = [&](const Arguments& more, int code, const std::string& named) {
        check_refused(joined({"linearize", scene.depth, "--camera", scene.camera, "-o", scene.out}, more), code, named);
    };
    const std::string mask = scene.saved("mask.png", mask_of());
    refused({"--ignore-below", "3"}, 2, "--ignore");
    refused({"--ignore", mask, "--ignore-below", "nan"}, 2, "number");
    refused({"--valid", "3,1"}, 2, "MIN <= MAX");
    refused({"--valid", "3"}, 2, "MIN <= MAX");
    refused({"--ignore", scene.saved("all.png", cv::Mat(height, width, CV_8UC1, cv::Scalar(1)))}, 1,
            "all.png is an alpha or a confidence, add --ignore-below");
    refused({"--ignore", scene.saved("small.png", mask_of()(cv::Rect(0, 0, 8, 8)))}, 1,
            "a mask has the size of the depth");
    refused({"--ignore", scene.saved("mask.jpg", mask_of())}, 1, "is a JPEG");
    refused({"--ignore", scene.folder / "none.png"}, 1, "none.png");
    const std::string layers = scene.folder / "layers.exr";
    write_image(layers, cv::Mat(height, width, CV_32FC3, cv::Scalar(0, 0, 0)),
                {.channels = {"N.X", "N.Y", "N.Z"}, .png_scale = {}});
    refused({"--ignore", layers, "--ignore-below", "1"}, 1, "is an alpha or a confidence");
    const std::string colors = scene.saved("colors.png", merged({mask_of(), mask_of(), mask_of()}));
    refused({"--ignore", colors, "--ignore-below", "1"}, 1, "no alpha");
}
