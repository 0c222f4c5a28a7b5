// The loop that all operations on depth images share.
#include "each_depth.hpp"

#include "codecs.hpp"
#include "command.hpp"
#include "interrupt.hpp"
#include "look.hpp"
#include "messages.hpp"
#include "relative.hpp"

#include "io/depth_channels.hpp"

#include <fathom/io.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <set>

namespace fathom::cli {
namespace {

using Clock = std::chrono::steady_clock;

DepthFile read(const std::filesystem::path& file, const ReadOptions& options) {
    const StderrSilenced silenced;
    return read_depth(file, options);
}

// The names of the channels that an image has: an alpha may be missing.
std::vector<std::string> channels_of(const Product& product, const cv::Mat& image) {
    const auto there = std::min(product.channels.size(), static_cast<std::size_t>(image.channels()));
    return {product.channels.begin(), product.channels.begin() + static_cast<std::ptrdiff_t>(there)};
}

void write(const DepthOptions& options, const std::vector<Output>& outputs, const Job& job,
           const std::vector<Result>& results) {
    std::vector<ImageFile> images;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const Product& product = outputs[i].product;
        images.push_back({job.outputs[i],
                          results[i].image,
                          {.channels = channels_of(product, results[i].image),
                           .png_scale = product.png_scale ? product.png_scale : options.png_scale,
                           .png_offset = product.png_offset},
                          product.kind,
                          results[i].format});
    }
    const StderrSilenced silenced;
    write_images(images);
}

// Another channel that could be the depth, where none was named.
std::vector<std::string> channel_doubts(const std::filesystem::path& file, const std::string& named,
                                        const std::string& taken) {
    if (!named.empty() || taken.empty())
        return {};
    const StderrSilenced silenced;
    std::vector<std::string> others = io::depth_channels(file);
    std::erase(others, taken);
    if (others.empty())
        return {};
    return {fmt::format("channel \"{}\" is taken, but {} could be depth, too; name the right one with --channel", taken,
                        one_of(others))};
}

// A --png-scale that cuts values off, or leaves only a few codes to them.
std::vector<std::string> png_doubts(const DepthOptions& options, const std::vector<Output>& outputs, const Job& job,
                                    const std::vector<Result>& results) {
    constexpr double many_cut = 0.01, few_codes = 64;
    std::vector<std::string> said;
    for (std::size_t i = 0; i < outputs.size() && options.png_scale; ++i) {
        if (outputs[i].product.png_scale.value_or(*options.png_scale) != *options.png_scale ||
            extension_of(job.outputs[i]) != ".png" || results[i].format)
            continue;
        const cv::Mat& image = results[i].image;
        std::size_t values = 0, cut = 0;
        float largest = 0;
        for (int y = 0; y < image.rows; ++y) {
            const auto* row = image.ptr<float>(y);
            for (int x = 0; x < image.cols * image.channels(); ++x)
                if (std::isfinite(row[x])) {
                    ++values;
                    cut += static_cast<double>(row[x]) * *options.png_scale > 1;
                    largest = std::max(largest, row[x]);
                }
        }
        const double codes = static_cast<double>(largest) * *options.png_scale * 65535;
        const std::string cure =
            fmt::format("--png-scale {:.2g} holds all up to {:.4g}", 0.99 / static_cast<double>(largest), largest);
        if (static_cast<double>(cut) > many_cut * static_cast<double>(values))
            said.push_back(fmt::format("--png-scale {} cuts {} of the values off; {}", number(*options.png_scale),
                                       percent(cut, values), cure));
        else if (largest > 0 && codes < few_codes)
            said.push_back(fmt::format("--png-scale {} leaves {:.0f} codes of 65535 to the values; {}",
                                       number(*options.png_scale), codes, cure));
    }
    return said;
}

// An option as a key of JSON: bent_normal for --bent-normal.
std::string key_of(const std::string& option) {
    std::string key = option.substr(option.find_first_not_of('-'));
    std::replace(key.begin(), key.end(), '-', '_');
    return key;
}

// When the work on an input began, and when it was read, computed and written.
struct Times {
    Clock::time_point start = Clock::now();
    Clock::time_point was_read = {}, was_computed = {}, was_written = {};
};

double seconds(Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double>(to - from).count();
}

void announce(Report report, const std::vector<Output>& outputs, const Job& job, const Result& made,
              const std::optional<Look>& look, const Times& times) {
    const cv::Mat& result = made.image;
    std::optional<PictureFormat> format;
    if (made.format)
        format = format_for(job.outputs.front(), *made.format);
    const double whole = seconds(times.start, times.was_written);
    switch (report) {
    case Report::nothing:
        return;
    case Report::line: {
        std::string files;
        for (const std::filesystem::path& file : job.outputs)
            files += (files.empty() ? "" : ", ") + file.native();
        std::string held = !format ? ""
                           : format->bits == 32
                               ? "  linear floats"
                               : fmt::format("  {}, {} bits", to_string(format->encoding), format->bits);
        if (look)
            held += "  " + in_words(*look);
        fmt::print("{}  {} × {}{}  {:.0f} ms\n", files, result.cols, result.rows, held, whole * 1e3);
        break;
    }
    case Report::json: {
        nlohmann::ordered_json line{{"input", job.input.native()},
                                    {"output", job.outputs.front().native()},
                                    {"width", result.cols},
                                    {"height", result.rows},
                                    {"channels", channels_of(outputs.front().product, result)},
                                    {"seconds", whole},
                                    {"read_seconds", seconds(times.start, times.was_read)},
                                    {"compute_seconds", seconds(times.was_read, times.was_computed)},
                                    {"write_seconds", seconds(times.was_computed, times.was_written)}};
        if (look) {
            line["nearest"] = look->surfaces() > 0 ? json_number(look->nearest) : nlohmann::ordered_json();
            line["farthest"] = look->surfaces() > 0 ? json_number(look->farthest) : nlohmann::ordered_json();
            line["background"] = look->background;
            line["invalid"] = look->invalid;
        }
        if (format) {
            line["color_space"] = to_string(format->encoding);
            line["bits"] = format->bits;
        }
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
    const bool relative = options.relative.order.has_value();
    const CameraFile camera = relative ? CameraFile{} : options.camera.read();
    const Device device = options.device.open();
    std::set<std::string> told;

    const auto process = [&](const Job& job) {
        Times times;
        const DepthFile depth = relative
                                    ? DepthFile{relative_depth(options.relative, job, options.channel, options.strict),
                                                Storage::float32,
                                                {}}
                                    : read(job.input, {.channel = options.channel, .packing = camera.packing});
        const int width = depth.values.cols, height = depth.values.rows;
        times.was_read = Clock::now();
        const StoredDepth stored{.image = to_device(device, depth.values),
                                 .camera = relative ? relative_camera(width, height, *options.relative.order)
                                                    : camera_for(camera, width, height),
                                 .storage = depth.storage};
        std::optional<Look> look;
        const auto warn = [&](const std::filesystem::path& subject, const std::vector<std::string>& said) {
            for (const std::string& doubt : said) {
                const std::string line = fmt::format("{}: {}", subject.native(), doubt);
                if (options.strict)
                    throw Error(line);
                if (subject == job.input || told.insert(line).second) // a camera's mistake is told once
                    complain("warning: " + line);
            }
        };
        if (!relative) {
            look = look_at(stored);
            warn(job.input, doubts(depth, stored, *look));
            warn(job.input, channel_doubts(job.input, options.channel, depth.channel));
            warn(options.camera.name(), options.camera.doubts(width, height));
        }
        if (more.doubts)
            warn(job.input, more.doubts(stored, look ? *look : look_at(stored)));
        const std::vector<Result> results = operation(stored, job);
        warn(job.input, png_doubts(options, outputs, job, results));
        times.was_computed = Clock::now();
        stop_if_interrupted();
        prepare_folders(options, outputs, job);
        write(options, outputs, job, results);
        for (std::size_t i = 0; i < outputs.size(); ++i)
            if (results[i].format && loses_metadata(job.outputs[i], *results[i].format))
                complain(
                    fmt::format("{}: does not hold the colour profile or the camera's data of the picture; write the "
                                "picture's own type to keep them",
                                job.outputs[i].native()));
        times.was_written = Clock::now();
        announce(options.report, outputs, job, results.front(), look, times);
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
            complain(
                about(relative ? job.input : std::filesystem::path(options.camera.name()), error.what(), {job.input}));
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
                      [&](const StoredDepth& stored, const Job&) { return std::vector<Result>{operation(stored)}; });
}

void check_same_size(const std::filesystem::path& file, const cv::Mat& image, const StoredDepth& stored,
                     const Job& job) {
    const int width = stored.image.width(), height = stored.image.height();
    if (image.cols != width || image.rows != height)
        throw Error(fmt::format("{}: is {} × {}, but {} is {} × {}; both must be of the same size", file.native(),
                                image.cols, image.rows, job.input.native(), width, height));
}

cv::Mat directions_for(const std::filesystem::path& file, cv::Mat directions) {
    if (extension_of(file) == ".png")
        for (int y = 0; y < directions.rows; ++y)
            for (int x = 0; x < directions.cols; ++x)
                if (auto& n = directions.at<cv::Vec3f>(y, x); n == cv::Vec3f(0, 0, 0))
                    n = cv::Vec3f::all(std::numeric_limits<float>::quiet_NaN());
    return directions;
}

} // namespace fathom::cli
