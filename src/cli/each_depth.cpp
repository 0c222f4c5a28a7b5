// The loop that all operations on depth images share.
#include "each_depth.hpp"

#include "codecs.hpp"
#include "command.hpp"
#include "interrupt.hpp"
#include "messages.hpp"

#include <fathom/io.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <new>

namespace fathom::cli {
namespace {

using Clock = std::chrono::steady_clock;

DepthFile read(const std::filesystem::path& file, const ReadOptions& options) {
    const StderrSilenced silenced;
    return read_depth(file, options);
}

// Those that an image has: an alpha may be missing.
std::vector<std::string> channels_of(const Product& product, const cv::Mat& image) {
    const auto there = std::min(product.channels.size(), static_cast<std::size_t>(image.channels()));
    return {product.channels.begin(), product.channels.begin() + static_cast<std::ptrdiff_t>(there)};
}

void write(const DepthOptions& options, const std::vector<Output>& outputs, const Job& job,
           const std::vector<cv::Mat>& results) {
    std::vector<ImageFile> images;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const Product& product = outputs[i].product;
        images.push_back({job.outputs[i],
                          results[i],
                          {.channels = channels_of(product, results[i]),
                           .png_scale = product.png_scale ? product.png_scale : options.png_scale,
                           .png_offset = product.png_offset}});
    }
    const StderrSilenced silenced;
    write_images(images);
}

// --bent-normal as a key of JSON.
std::string key_of(const std::string& option) {
    std::string key = option.substr(option.find_first_not_of('-'));
    std::replace(key.begin(), key.end(), '-', '_');
    return key;
}

void announce(Report report, const std::vector<Output>& outputs, const Job& job, const cv::Mat& result,
              double seconds) {
    switch (report) {
    case Report::nothing:
        return;
    case Report::line: {
        std::string files;
        for (const std::filesystem::path& file : job.outputs)
            files += (files.empty() ? "" : ", ") + file.native();
        fmt::print("{}  {} × {}  {:.0f} ms\n", files, result.cols, result.rows, seconds * 1e3);
        break;
    }
    case Report::json: {
        nlohmann::ordered_json line{{"input", job.input.native()},
                                    {"output", job.outputs.front().native()},
                                    {"width", result.cols},
                                    {"height", result.rows},
                                    {"channels", channels_of(outputs.front().product, result)},
                                    {"seconds", seconds}};
        for (std::size_t i = 1; i < outputs.size(); ++i)
            line[key_of(outputs[i].option)] = job.outputs[i].native();
        print_json(line);
    }
    }
    std::fflush(stdout);
}

} // namespace

int each_depth(const DepthOptions& options, const Product& product, const More& more, const Operation& operation) {
    catch_interrupts();
    std::vector<Output> outputs{{"-o", options.output, product}};
    outputs.insert(outputs.end(), more.outputs.begin(), more.outputs.end());
    const std::vector<Job> jobs = plan(options, outputs, more.companions);
    const CameraFile camera = read_camera(options.camera);
    const Device device = options.device.open();

    const auto process = [&](const Job& job) {
        const Clock::time_point start = Clock::now();
        const DepthFile depth = read(job.input, {.channel = options.channel, .packing = camera.packing});
        const std::vector<cv::Mat> results =
            operation({.image = to_device(device, depth.values),
                       .camera = camera_for(camera, depth.values.cols, depth.values.rows),
                       .storage = depth.storage},
                      job);
        stop_if_interrupted();
        prepare_folders(options, outputs, job);
        write(options, outputs, job, results);
        announce(options.report, outputs, job, results.front(),
                 std::chrono::duration<double>(Clock::now() - start).count());
    };

    int code = done;
    for (const Job& job : jobs) {
        stop_if_interrupted();
        try {
            process(job);
        } catch (const std::bad_alloc&) {
            complain(about(job.input, "not enough memory for an image of this size; crop it or split it"));
            code = input_failed;
        } catch (const std::invalid_argument& error) { // a field of the camera
            complain(about(options.camera, error.what(), {job.input}));
            code = input_failed;
        } catch (const std::exception& error) {
            complain(about(job.input, error.what(), job.others()));
            code = input_failed;
        }
    }
    return code;
}

int each_depth(const DepthOptions& options, const Product& product,
               const std::function<cv::Mat(const StoredDepth&)>& operation) {
    return each_depth(options, product, {},
                      [&](const StoredDepth& stored, const Job&) { return std::vector{operation(stored)}; });
}

cv::Mat directions_for(const std::filesystem::path& file, cv::Mat directions) {
    if (ending_of(file) == ".png")
        for (int y = 0; y < directions.rows; ++y)
            for (int x = 0; x < directions.cols; ++x)
                if (auto& n = directions.at<cv::Vec3f>(y, x); n == cv::Vec3f(0, 0, 0))
                    n = cv::Vec3f::all(std::numeric_limits<float>::quiet_NaN());
    return directions;
}

} // namespace fathom::cli
