// Targets that read images, each through the public functions that read its format.
#include "reading.hpp"
#include "repair.hpp"

#include "io/formats.hpp"

#include <fathom/import_camera.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>
#include <fathom/relative.hpp>

#include <opencv2/core/utils/logger.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace fs = std::filesystem;

namespace fathom::fuzz {
namespace {

constexpr std::size_t largest_image = 2048;

constexpr std::optional<Packing> packings[] = {std::nullopt,          Packing::rgb_red_low,   Packing::rgb_red_high,
                                               Packing::rgba_red_low, Packing::rgba_red_high, Packing::uint8,
                                               Packing::uint24_high};

void read_one(const fs::path& file, unsigned choice) {
    switch (choice % 4) {
    case 0: {
        const ReadOptions options{.packing = packings[choice / 4 % std::size(packings)],
                                  .overscan = (choice & 128) != 0};
        const DepthFile depth = read_depth(file, options);
        expect(!depth.values.empty() && depth.windows.data.size() == depth.values.size(), "depth without pixels");
        return;
    }
    case 1: {
        const cv::Mat color = read_picture(file, {}).color;
        expect(!color.empty() && (color.type() == CV_32FC3 || color.type() == CV_32FC4), "no picture");
        return;
    }
    case 2: {
        const cv::Mat normals = read_normals(file);
        expect(!normals.empty() && normals.type() == CV_32FC3, "no normals");
        for (const cv::Vec3f& n : cv::Mat_<cv::Vec3f>(normals))
            expect(n == cv::Vec3f(0, 0, 0) || std::isfinite(std::hypot(n[0], n[1], n[2])), "no normal");
        return;
    }
    default: {
        const RelativeFile relative = read_relative(file);
        expect(relative.values.type() == CV_32FC1, "no relative depth");
        for (const float value : cv::Mat_<float>(relative.values))
            expect(std::isnan(value) || (value >= 0 && value <= 1), "relative depth beyond 0 and 1");
    }
    }
}

void run(Input input, const std::string& name) {
    static const bool prepared = [] {
        cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
        io::most_from_nothing = 1u << 24; // several images of that size are made in a second
        return true;
    }();
    expect(prepared, "");
    const unsigned choice = taken_choice(input);
    const fs::path file = file_with(name, input);
    read_or_refuse(file, [&] { read_one(file, choice); });
}

void run_exr(Input input) {
    run(input, "image.exr");
    taken_choice(input);
    const fs::path file = file_with("image.exr", input);
    read_or_refuse(file, [&] {
        for (const Channel& channel : list_channels(file))
            expect(!channel.type.empty(), "a channel without a type");
    });
    read_or_refuse(file, [&] { import_camera(file, {}); });
}

void run_png(Input input) {
    run(input, "image.png");
}

void run_tiff(Input input) {
    run(input, "image.tif");
}

void run_jpeg(Input input) {
    run(input, "image.jpg");
}

/// PFM, PGM, NPY and Radiance HDR: the content decides.
void run_plain(Input input) {
    run(input, "image");
}

constexpr Target targets[] = {
    {"exr", run_exr, repair_exr, largest_image},    {"png", run_png, repair_png, largest_image},
    {"tiff", run_tiff, repair_tiff, largest_image}, {"jpeg", run_jpeg, nullptr, largest_image},
    {"plain", run_plain, nullptr, largest_image},
};

} // namespace

std::span<const Target> image_targets() {
    return targets;
}

} // namespace fathom::fuzz
