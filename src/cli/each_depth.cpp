// The loop that all operations on depth images share.
#include "each_depth.hpp"

#include "codecs.hpp"
#include "command.hpp"
#include "interrupt.hpp"
#include "look.hpp"
#include "messages.hpp"
#include "relative.hpp"

#include "camera_file/file.hpp"
#include "camera_file/key_doubts.hpp"

#include "io/depth_channels.hpp"

#include "text.hpp"

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

// The camera of the pixels that were read.
Camera camera_of(const CameraFile& file, const Windows& windows) {
    const Camera camera = camera_for(file, windows.display.width, windows.display.height);
    const cv::Rect& part = windows.data;
    const bool whole = part == cv::Rect({0, 0}, windows.display);
    return whole ? camera : cropped(camera, part.x, part.y, part.width, part.height);
}

DepthFile read(const std::filesystem::path& file, const ReadOptions& options) {
    const StderrSilenced silenced;
    return read_depth(file, options);
}

// The names of the channels that an image has: an alpha may be missing.
std::vector<std::string> channels_of(const Product& product, const cv::Mat& image) {
    const auto there = std::min(product.channels.size(), static_cast<std::size_t>(image.channels()));
    return {product.channels.begin(), product.channels.begin() + static_cast<std::ptrdiff_t>(there)};
}

bool is_exr(const std::filesystem::path& file) {
    return std::filesystem::is_regular_file(file) && !list_channels(file).empty();
}

// Overscan is computed, too, unless a file beside the depth cannot hold it.
bool takes_overscan(const Job& job) {
    return std::ranges::all_of(job.companions, is_exr);
}

// The EXR whose header the results keep: that of the picture they are made of, or that of the depth.
std::optional<ExrSource> source_of(const More& more, const Job& job, const DepthFile& depth) {
    if (more.picture && is_exr(job.companions[*more.picture])) {
        const std::filesystem::path& file = job.companions[*more.picture];
        return ExrSource{file, color_channels(file, more.color_layer).front(), depth.windows};
    }
    if (depth.channel.empty())
        return std::nullopt;
    return ExrSource{job.input, depth.channel, depth.windows};
}

// A file that has no windows gets the pixels of the display window. So it does not depend on where a renderer had pixels.
void fit(cv::Mat& image, const Windows& windows, const std::filesystem::path& file, ImageKind kind) {
    const std::string extension = extension_of(file);
    if (extension == ".exr" || extension == ".ply" || image.size() != windows.data.size())
        return;
    cv::Mat whole(windows.display, image.type());
    whole.setTo(cv::Scalar::all(kind == ImageKind::color ? 0 : std::numeric_limits<double>::quiet_NaN()));
    if (const cv::Rect seen = windows.data & cv::Rect({0, 0}, windows.display); !seen.empty())
        image(seen - windows.data.tl()).copyTo(whole(seen));
    image = whole;
}

// Names for channels among others: "linear" in front of Z, which a depth image has already.
std::vector<std::string> in_layer(std::vector<std::string> channels, const std::string& layer) {
    for (std::string& channel : channels)
        channel.insert(0, layer.empty() ? "" : layer + ".");
    return channels;
}

void write(const DepthOptions& options, const std::vector<Output>& outputs, const Job& job,
           const std::vector<Result>& results, const std::optional<ExrSource>& source) {
    std::vector<ImageFile> images;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const Product& product = outputs[i].product;
        const cv::Mat& image = results[i].image;
        WriteOptions how{.channels = channels_of(product, image),
                         .png_scale = product.png_scale ? product.png_scale : options.png_scale,
                         .png_offset = product.png_offset,
                         .source = source,
                         .half = options.half,
                         .compression = options.compression,
                         .normals = results[i].normals,
                         .colors = results[i].colors};
        if (source && results[i].part)
            how.source->windows.data = *results[i].part + source->windows.data.tl();
        else if (source && image.size() != source->windows.data.size()) // not one value a pixel
            how.source.reset();
        if (i == 0 && options.append) {
            if (!how.source)
                throw Error(job.outputs[i].native() +
                            ": has another size than its input, which --append cannot add to");
            how.source->append = true;
            how.channels = in_layer(how.channels, product.layer);
        }
        images.push_back({job.outputs[i], image, how, product.kind, results[i].format});
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

// A result that cannot hold what goes with the picture it is made of.
std::vector<std::string> metadata_doubts(const std::filesystem::path& file, const Result& result) {
    if (result.format && result.format->incomplete)
        return {
            "does not hold the picture's Exif data or its grey profile, which are not read; copy them with exiftool"};
    if (!result.format || !loses_metadata(file, *result.format))
        return {};
    return {"does not hold the colour profile or the camera's data of the picture; write the picture's own type to "
            "keep them"};
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

// What the depth holds, for the line about a result and for --json.
struct Held {
    std::string channel, words;
    nlohmann::ordered_json members;
};

Held held(const std::string& channel, const Look& look) {
    const auto end = [&](float z) { return look.surfaces() > 0 ? json_number(z) : nlohmann::ordered_json(); };
    return {channel,
            in_words(look),
            {{"nearest", end(look.nearest)},
             {"farthest", end(look.farthest)},
             {"background", look.background},
             {"invalid", look.invalid}}};
}

Held held(const io::RelativeInput& input) {
    return {input.channel,
            in_words(input),
            {{"stored", {{"min", json_number(input.least)}, {"max", json_number(input.greatest)}}},
             {"invalid", input.invalid}}};
}

void announce(Report report, const std::vector<Output>& outputs, const Job& job, const Result& made, const Held& depth,
              const Times& times) {
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
        const std::string picture = !format ? ""
                                    : format->bits == 32
                                        ? "  linear floats"
                                        : fmt::format("  {}, {} bits", to_string(format->encoding), format->bits);
        const std::string channel = depth.channel.empty() ? "" : io::printable(depth.channel) + ": ";
        fmt::print("{}  {} × {}{}  {}{}  {:.0f} ms\n", files, result.cols, result.rows, picture, channel, depth.words,
                   whole * 1e3);
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
        if (!depth.channel.empty())
            line["depth_channel"] = depth.channel;
        line.update(depth.members);
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
    if (!relative)
        options.camera.read(); // what is wrong for all inputs is told once
    const Device device = options.device.open();
    std::set<std::string> told;

    const auto process = [&](Job job) {
        Times times;
        ImportedCamera camera = relative ? ImportedCamera{} : options.camera.read_for(job.input);
        RelativeDepth of_relative = relative ? relative_depth(options.relative, job, options.channel) : RelativeDepth{};
        const DepthFile depth =
            relative ? std::move(of_relative.depth)
                     : read(job.input,
                            {.channel = options.channel, .packing = camera.packing, .overscan = takes_overscan(job)});
        if (!relative && depth.storage != Storage::float32) // on which the unit may depend
            camera = options.camera.read_for(job.input, depth.storage);
        const std::filesystem::path described =
            options.camera.of_headers() ? job.input.native() : options.camera.name();
        job.windows = depth.windows;
        if (options.camera.of_headers())
            job.header = camera;
        times.was_read = Clock::now();
        const StoredDepth stored{
            .image = to_device(device, depth.values),
            .camera = relative ? relative_camera(depth.values.cols, depth.values.rows, *options.relative.order)
                               : camera_of(camera, depth.windows),
            .storage = depth.storage};
        const std::optional<ExrSource> source = source_of(more, job, depth);
        if (options.append && !source && relative && !more.picture)
            throw Error(
                fmt::format("{}: --append does not go with --relative; leave --append out", job.input.native()));
        if (options.append && !source)
            throw Error(fmt::format("{}: is no OpenEXR file, and --append adds to one; leave --append out",
                                    (more.picture ? job.companions[*more.picture] : job.input).native()));
        const auto warn = [&](const std::filesystem::path& subject, const std::vector<std::string>& said) {
            for (const std::string& doubt : said) {
                const std::string line = fmt::format("{}: {}", subject.native(), doubt);
                if (options.strict)
                    throw Error(line);
                if (subject == job.input || told.insert(line).second) // a camera's mistake is told once
                    complain("warning: " + line);
            }
            return !said.empty();
        };
        const Look look = look_at(stored);
        const bool doubtful_values = warn(job.input, relative ? of_relative.doubts : doubts(depth, stored, look));
        bool doubtful_camera = false;
        if (!relative) {
            warn(job.input, channel_doubts(job.input, options.channel, depth.channel));
            doubtful_camera |= warn(described, camera.warnings);
            doubtful_camera |=
                warn(described, io::key_doubts(nlohmann::json::parse(camera.text), depth.windows.display.width,
                                               depth.windows.display.height));
        }
        if (more.doubts)
            warn(job.input, more.doubts(job));
        if (more.length_doubts && !doubtful_values && !doubtful_camera) // or one mistake would be told twice
            warn(job.input, more.length_doubts(stored, look, job));
        std::vector<Result> results = operation(stored, job);
        for (std::size_t i = 0; i < outputs.size() && has_overscan(job); ++i)
            fit(results[i].image, job.windows, job.outputs[i], outputs[i].product.kind);
        if (!doubtful_values)
            warn(job.input, png_doubts(options, outputs, job, results));
        for (std::size_t i = 0; i < outputs.size(); ++i)
            warn(job.outputs[i], metadata_doubts(job.outputs[i], results[i]));
        times.was_computed = Clock::now();
        stop_if_interrupted();
        prepare_folders(options, outputs, job);
        write(options, outputs, job, results, source);
        times.was_written = Clock::now();
        announce(options.report, outputs, job, results.front(),
                 relative ? held(of_relative.input) : held(depth.channel, look), times);
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
            const bool of_input = relative || options.camera.of_headers();
            complain(
                about(of_input ? job.input : std::filesystem::path(options.camera.name()), error.what(), {job.input}));
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

bool has_overscan(const Job& job) {
    return job.windows.data != cv::Rect({0, 0}, job.windows.display);
}

void check_same_pixels(const std::filesystem::path& file, const DepthFile& other, const StoredDepth& stored,
                       const Job& job) {
    check_same_size(file, other.values, stored, job);
    if (other.windows != job.windows)
        throw Error(fmt::format("{}: has other data and display windows than {}; write both with the same ones",
                                file.native(), job.input.native()));
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
