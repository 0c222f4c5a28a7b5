// The loop that all operations on depth images share.
#include "each_depth.hpp"

#include "codecs.hpp"
#include "command.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "outputs.hpp"

#include <fathom/io.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <new>

namespace fathom::cli {
namespace {

using Clock = std::chrono::steady_clock;

DepthFile read(const std::filesystem::path& file, const ReadOptions& options) {
    const StderrSilenced silenced;
    return read_depth(file, options);
}

void write(const std::filesystem::path& file, const cv::Mat& image, const WriteOptions& options) {
    const StderrSilenced silenced;
    write_image(file, image, options);
}

void announce(Report report, const Job& job, const cv::Mat& result, const Product& product, double seconds) {
    switch (report) {
    case Report::nothing:
        return;
    case Report::line:
        fmt::print("{}  {} × {}  {:.0f} ms\n", job.output.native(), result.cols, result.rows, seconds * 1e3);
        break;
    case Report::json:
        print_json({{"input", job.input.native()},
                    {"output", job.output.native()},
                    {"width", result.cols},
                    {"height", result.rows},
                    {"channels", product.channels},
                    {"seconds", seconds}});
    }
    std::fflush(stdout);
}

} // namespace

int each_depth(const DepthOptions& options, const Product& product,
               const std::function<cv::Mat(const StoredDepth&)>& operation) {
    catch_interrupts();
    const std::vector<Job> jobs = plan(options, product.endings);
    const CameraFile camera = read_camera(options.camera);
    const Device device = options.device.open();

    const auto process = [&](const Job& job) {
        const Clock::time_point start = Clock::now();
        const DepthFile depth = read(job.input, {.channel = options.channel, .packing = camera.packing});
        const cv::Mat result = operation({.image = to_device(device, depth.values),
                                          .camera = camera_for(camera, depth.values.cols, depth.values.rows),
                                          .storage = depth.storage});
        stop_if_interrupted();
        prepare_folder(options, job);
        write(job.output, result, {.channels = product.channels, .png_scale = options.png_scale});
        announce(options.report, job, result, product, std::chrono::duration<double>(Clock::now() - start).count());
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
            complain(about(job.input, error.what(), {job.output}));
            code = input_failed;
        }
    }
    return code;
}

} // namespace fathom::cli
