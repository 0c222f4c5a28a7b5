// The loop that all operations on depth images share.
#include "each_depth.hpp"

#include "codecs.hpp"
#include "command.hpp"
#include "interrupt.hpp"
#include "look.hpp"
#include "messages.hpp"
#include "progress.hpp"
#include "record.hpp"
#include "relative.hpp"
#include "run_log.hpp"
#include "strip_limits.hpp"

#include "camera_file/file.hpp"
#include "camera_file/key_doubts.hpp"

#include "io/depth_channels.hpp"
#include "io/rows.hpp"

#include "text.hpp"

#include <fathom/error.hpp>
#include <fathom/frames.hpp>
#include <fathom/io.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <future>
#include <limits>
#include <new>
#include <set>
#include <stdexcept>
#include <utility>

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

DepthFile read_file(const std::filesystem::path& file, const ReadOptions& options) {
    const StderrSilenced silenced;
    return read_depth(file, options);
}

// The names of the channels that an image has: an alpha may be missing.
std::vector<std::string> channels_of(const Product& product, const cv::Mat& image) {
    const auto there = std::min(product.channels.size(), static_cast<std::size_t>(image.channels()));
    return {product.channels.begin(), product.channels.begin() + static_cast<std::ptrdiff_t>(there)};
}

bool is_exr(const std::filesystem::path& file) {
    return io::is_file(file) && !list_channels(file).empty();
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

std::vector<ImageFile> files_of(const DepthOptions& options, const std::vector<Output>& outputs, const Job& job,
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
        else if (source && results[i].size != source->windows.data.size()) // not one value a pixel
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
    return images;
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

// Seconds that the steps of an input took. It waits between them, which does not count.
struct Times {
    double read = 0, compute = 0, write = 0;

    double whole() const { return read + compute + write; }
};

// Adds the seconds of its own life.
class Stopwatch {
public:
    explicit Stopwatch(double& seconds) : seconds_(seconds) {}
    ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& seconds_;
    Clock::time_point start_ = Clock::now();
};

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

// What `make` gives or throws, for whoever asks later.
template <typename Make>
auto later(const Make& make) {
    std::promise<decltype(make())> promise;
    try {
        promise.set_value(make());
    } catch (...) {
        promise.set_exception(std::current_exception());
    }
    return promise.get_future().share();
}

// An input between the steps.
struct Work {
    Loaded frame;
    Times times;
    // Read.
    std::optional<nlohmann::ordered_json> record; // of a run with records
    bool kept = false;                            // lie the results there already?
    DepthFile depth{{}, Storage::float32, {}};
    std::unique_ptr<io::DepthRows> rows; // of an input that is done strip by strip: `depth` has no values
    std::unique_ptr<io::PictureRows> picture;
    std::optional<RelativeDepth> relative; // all but its depth
    ImportedCamera camera;
    Camera seen; // by the pixels
    std::optional<ExrSource> source;
    std::vector<std::string> channel_doubts;
    std::shared_future<std::vector<std::string>> option_doubts;
    // Looked at.
    Subject subject;
    std::vector<std::string> value_doubts, camera_doubts;
    Held held;
    // Computed.
    bool doubtful_values = false;
    std::vector<std::string> explained; // by an operation that went by strips
    std::exception_ptr failure;         // of a strip: told after what is doubtful about the image
    std::vector<Result> results;
    std::unique_ptr<io::ResultRows> file; // of the result, if it is made strip by strip
};

// The files of an input for --json and --log.
nlohmann::ordered_json files_in_json(const std::vector<Output>& outputs, const Job& job) {
    nlohmann::ordered_json line{{"input", job.input.native()}};
    if (!job.outputs.empty())
        line["output"] = job.outputs.front().native();
    if (job.in_sequence && job.frame)
        line["frame"] = *job.frame;
    if (job.held)
        line["held"] = *job.held;
    for (std::size_t i = 1; i < job.outputs.size(); ++i)
        line[key_of(outputs[i].option)] = job.outputs[i].native();
    return line;
}

std::optional<PictureFormat> written_format(const Job& job, const Result& made) {
    return made.format ? std::optional(format_for(job.outputs.front(), *made.format)) : std::nullopt;
}

nlohmann::ordered_json times_in_json(const Times& times) {
    return {{"seconds", times.whole()},
            {"read_seconds", times.read},
            {"compute_seconds", times.compute},
            {"write_seconds", times.write}};
}

nlohmann::ordered_json result_in_json(const std::vector<Output>& outputs, const Work& work) {
    const Job& job = work.frame;
    nlohmann::ordered_json line = files_in_json(outputs, job);
    if (work.kept) {
        line["kept"] = true;
        return line;
    }
    const Result& made = work.results.front();
    line.update({{"width", made.size.width},
                 {"height", made.size.height},
                 {"channels", channels_of(outputs.front().product, made.image)}});
    line.update(times_in_json(work.times));
    if (!work.held.channel.empty())
        line["depth_channel"] = work.held.channel;
    line.update(work.held.members);
    if (const auto format = written_format(job, made)) {
        line["color_space"] = to_string(format->encoding);
        line["bits"] = format->bits;
    }
    return line;
}

std::string result_in_words(const Work& work) {
    const Job& job = work.frame;
    std::string line;
    for (const std::filesystem::path& file : job.outputs)
        line += (line.empty() ? "" : ", ") + file.native();
    if (work.kept)
        return line + "  kept";
    const Result& made = work.results.front();
    const auto format = written_format(job, made);
    const std::string picture = !format ? ""
                                : format->bits == 32
                                    ? "  linear floats"
                                    : fmt::format("  {}, {} bits", to_string(format->encoding), format->bits);
    const Held& depth = work.held;
    const std::string channel = depth.channel.empty() ? "" : io::printable(depth.channel) + ": ";
    const std::string held = job.held ? fmt::format("  frame {} held", *job.held) : "";
    return fmt::format("{}  {} × {}{}  {}{}{}  {:.0f} ms", line, made.size.width, made.size.height, picture, channel,
                       depth.words, held, work.times.whole() * 1e3);
}

void announce(Report report, const std::vector<Output>& outputs, const Work& work) {
    if (report == Report::line)
        fmt::print("{}\n", result_in_words(work));
    if (report == Report::json)
        print_json(result_in_json(outputs, work));
    flush_output();
}

// The line of a frame in the log.
nlohmann::ordered_json log_line(const std::vector<Output>& outputs, const Work& work, const std::string& error) {
    constexpr std::string_view warning = "warning: ";
    nlohmann::ordered_json line{{"status", !error.empty() ? "failed" : work.kept ? "kept" : "made"}};
    line.update(error.empty() ? result_in_json(outputs, work) : files_in_json(outputs, work.frame));
    line.update(times_in_json(work.times));
    line.erase("kept");
    line["warnings"] = nlohmann::ordered_json::array();
    for (const std::string& said : work.frame.said)
        if (said.starts_with(warning))
            line["warnings"].push_back(said.substr(warning.size()));
    if (!error.empty())
        line["error"] = error;
    if (!work.camera.text.empty())
        line["camera"] = nlohmann::ordered_json::parse(work.camera.text);
    return line;
}

// The steps of an input. Only `compute` goes from input to input in order; the others see nothing but their own.
// `apart`: the device waits while files are read.
class Steps {
public:
    Steps(const DepthOptions& options, const std::vector<Output>& outputs, const More& more, const Operation& operation,
          const Device& device, bool apart)
        : options_(options), outputs_(outputs), more_(more), operation_(operation), device_(device), apart_(apart) {
        if (options.resume)
            records_.emplace(options, outputs_, more.companions, device);
    }

    void read(Work& work) const;
    void compute(Work& work);
    void write(Work& work) const;

    // The bytes of the images that an input holds until it is written: of what was read, of its results and of their files.
    std::size_t bytes(const Work& work) const;

private:
    bool is_relative() const { return options_.relative.order.has_value(); }
    void load(Work& work) const;
    ReadOptions read_options(const Work& work) const;
    bool goes_by_strips(const Job& job, const io::DepthRows& rows) const;
    void examine(Work& work) const;
    void find_doubts(Work& work) const;
    void stream(Work& work);
    std::size_t row_bytes(int width, bool picture) const;
    std::size_t strip_bytes() const;
    int strip_rows(const Work& work) const;
    void write_strip(Work& work, Result& result, const cv::Range& rows) const;
    cv::Mat decoded(const Work& work, const cv::Mat& values, int first_row) const;
    bool is_finished(Work& work) const;
    void check_append(const Work& work) const;
    void warn(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said) const;
    bool warn_once(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said);

    const DepthOptions& options_;
    const std::vector<Output>& outputs_;
    const More& more_;
    const Operation& operation_;
    Device device_;
    bool apart_;
    std::optional<Records> records_;
    std::set<std::string> told_; // warnings that are no input's own
};

void Steps::read(Work& work) const {
    const Stopwatch watch(work.times.read);
    Loaded& frame = work.frame;
    if (!frame.missing.empty())
        throw Error(missing_in_words(options_, frame));
    work.kept = is_finished(work);
    if (work.kept)
        return;
    load(work);
    if (!apart_ && !work.rows)
        examine(work);
}

// Takes the hashes of what the input is read from before it is read: a file that changes meanwhile has another one next time.
bool Steps::is_finished(Work& work) const {
    if (!records_)
        return false;
    if (!is_relative())
        work.camera = options_.camera.read_for(work.frame.read_as());
    work.record = records_->of(work.frame, work.camera.text);
    return records_->is_finished(*work.record, work.frame);
}

void Steps::load(Work& work) const {
    Loaded& frame = work.frame;
    if (is_relative()) {
        work.relative = relative_depth(options_.relative, frame, options_.channel);
        work.depth = std::exchange(work.relative->depth, {{}, Storage::float32, {}});
    } else {
        work.camera = options_.camera.read_for(frame.read_as());
        work.rows = io::depth_rows(frame.input, read_options(work));
        if (!work.rows)
            work.depth = read_file(frame.input, read_options(work));
        else if (goes_by_strips(frame, *work.rows))
            work.depth = work.rows->about();
        else
            work.depth = io::whole(frame.input, *std::exchange(work.rows, nullptr));
        if (work.depth.storage != Storage::float32) // on which the unit may depend
            work.camera = options_.camera.read_for(frame.read_as(), work.depth.storage);
        if (options_.camera.of_each_input())
            frame.own_camera = work.camera;
    }
    const DepthFile& depth = work.depth;
    frame.windows = depth.windows;
    work.seen = is_relative() ? relative_camera(depth.values.cols, depth.values.rows, *options_.relative.order)
                              : camera_of(work.camera, depth.windows);
    work.source = source_of(more_, frame, depth);
    check_append(work);
    if (!is_relative())
        work.channel_doubts = channel_doubts(frame.input, options_.channel, depth.channel);
    const Job& job = frame;
    work.option_doubts = later([&] { return more_.doubts ? more_.doubts(job) : std::vector<std::string>{}; });
    if (work.rows && more_.picture_rows)
        work.picture = more_.picture_rows(job);
    if (!work.picture)
        frame.images = later([&] { return more_.read ? more_.read(job) : Images{}; });
}

ReadOptions Steps::read_options(const Work& work) const {
    return {.channel = options_.channel, .packing = work.camera.packing, .overscan = takes_overscan(work.frame)};
}

// Results with a record, and those that are appended, are made of all their bytes.
bool Steps::goes_by_strips(const Job& job, const io::DepthRows& rows) const {
    const std::filesystem::path& output = job.outputs.front();
    const Windows& windows = rows.about().windows;
    const bool is_exr_file = extension_of(output) == ".exr",
               overscan = windows.data != cv::Rect({0, 0}, windows.display);
    const auto [width, height] = rows.size();
    const bool too_many = static_cast<long long>(width) * height > strip_limits.whole_pixels;
    const bool too_large =
        options_.memory > 0 && row_bytes(width, false) * static_cast<std::size_t>(height) > options_.memory;
    return more_.halo && outputs_.size() == 1 && !records_ && !options_.append && io::takes_rows(output) &&
           (is_exr_file || !overscan) && (too_many || too_large);
}

// Looks at what was read, while other inputs are computed: the device need not wait for the host's part of it.
void Steps::examine(Work& work) const {
    const DepthFile& depth = work.depth;
    work.subject.stored = {.image = to_device(device_, depth.values), .camera = work.seen, .storage = depth.storage};
    work.subject.look = look_at(work.subject.stored);
    work.subject.each = [&work](const auto& visit) { visit(work.depth.values, work.subject.look.z); };
    work.subject.places = [&work] { return Places(work.depth, work.subject.look.z); };
    find_doubts(work);
}

void Steps::find_doubts(Work& work) const {
    if (is_relative()) {
        work.held = held(work.relative->input);
        work.value_doubts = work.relative->doubts;
        return;
    }
    work.held = held(work.depth.channel, work.subject.look);
    work.value_doubts = doubts(work.subject);
    const cv::Size display = work.depth.windows.display;
    work.camera_doubts = io::key_doubts(nlohmann::json::parse(work.camera.text), display.width, display.height);
}

cv::Mat Steps::decoded(const Work& work, const cv::Mat& values, int first_row) const {
    StoredDepth stored = work.subject.stored;
    stored.image = to_device(device_, values);
    stored.y = first_row;
    return look_at(stored).z;
}

// What a row of the images takes: depth, two copies of it, the result and its file, and a picture.
std::size_t Steps::row_bytes(int width, bool picture) const {
    const std::size_t channels = outputs_.front().product.channels.size();
    return (3 + 2 * channels + (picture ? 2 * channels : 0)) * sizeof(float) * static_cast<std::size_t>(width);
}

std::size_t Steps::strip_bytes() const {
    constexpr std::size_t least = std::size_t{1} << 20;
    return options_.memory > 0 ? std::min(strip_limits.strip_bytes, std::max(options_.memory, least))
                               : strip_limits.strip_bytes;
}

int Steps::strip_rows(const Work& work) const {
    const std::size_t row = row_bytes(work.rows->size().width, work.picture != nullptr);
    const int rows = static_cast<int>(std::min<std::size_t>(strip_bytes() / row, 1 << 16));
    constexpr int block = 32; // of most compressions: more than one strip would unpack those that it cuts
    return std::max({rows - (rows > block ? rows % block : 0), *more_.halo + 1, 1});
}

void Steps::write_strip(Work& work, Result& result, const cv::Range& rows) const {
    const Stopwatch watch(work.times.write);
    const cv::Mat image = result.image.rowRange(rows);
    if (!work.file) {
        result.image = cv::Mat(1, 1, image.type());
        result.size = work.rows->size();
        work.results = {result};
        prepare_folders(options_, outputs_, work.frame);
        const ImageFile file = files_of(options_, outputs_, work.frame, work.results, work.source).front();
        work.file = std::make_unique<io::ResultRows>(file, result.size);
    }
    work.file->write(image);
}

// Reads, looks at, computes and writes some rows after the others. What they say together is found at the end.
void Steps::stream(Work& work) {
    Loaded& frame = work.frame;
    const int height = work.rows->size().height, halo = *more_.halo, most = strip_rows(work);
    Subject& subject = work.subject;
    subject.stored = {.image = {}, .camera = work.seen, .storage = work.depth.storage};
    Places places(work.rows->size(), work.depth.storage);
    cv::Mat values, picture; // from `first` on
    Loaded strip = frame;
    for (int first = 0, made = 0, read = 0; made < height;) {
        const int rows = std::min(most, height - read), end = read + rows == height ? height : read + rows - halo;
        {
            const Stopwatch watch(work.times.read);
            const auto join = [&](cv::Mat& kept, const cv::Mat& next) {
                if (kept.empty())
                    kept = next;
                else
                    cv::vconcat(kept, next, kept);
            };
            const cv::Mat next = work.rows->read(rows).values;
            const cv::Mat z = decoded(work, next, read);
            add(subject.look, z);
            places.add(next, z);
            join(values, next);
            if (work.picture)
                join(picture, work.picture->read(rows).color);
        }
        read += rows;
        const auto compute = [&] {
            const Stopwatch watch(work.times.compute);
            if (work.picture)
                strip.images = later([&] { return Images{.picture = {picture, work.picture->format()}}; });
            else if (more_.picture)
                strip.images = later([&] {
                    const Picture& whole = frame.images.get().picture;
                    return Images{.picture = {whole.color.rowRange(first, read), whole.format}};
                });
            StoredDepth stored = subject.stored;
            stored.image = to_device(device_, values);
            stored.y = first;
            return operation_(stored, strip);
        };
        try {
            if (!work.failure) {
                std::vector<Result> results = compute();
                write_strip(work, results.front(), {made - first, end - first});
                if (made == 0)
                    work.explained = std::move(strip.said);
            }
        } catch (...) {
            work.failure = std::current_exception(); // the other rows may say what is wrong with the image
        }
        made = end;
        const int kept = read == height ? height : std::max(made - halo, first);
        const auto keep = [&](cv::Mat& image) {
            image = kept < read ? image.rowRange(kept - first, image.rows).clone() : cv::Mat();
        };
        keep(values);
        if (work.picture)
            keep(picture);
        first = kept;
    }
    subject.places = [places] { return places; };
    subject.each = [this, &work, most](const auto& visit) {
        const auto again = io::depth_rows(work.frame.input, read_options(work));
        for (int y = 0; y < again->size().height; y += most) {
            const cv::Mat rows = again->read(std::min(most, again->size().height - y)).values;
            visit(rows, decoded(work, rows, y));
        }
    };
    find_doubts(work);
}

void Steps::compute(Work& work) {
    if (work.kept)
        return;
    Loaded& frame = work.frame;
    set_values(options_.animations, frame.values);
    if (work.rows)
        stream(work);
    else if (apart_) {
        const Stopwatch watch(work.times.read);
        examine(work);
    }
    const Stopwatch watch(work.times.compute);
    work.doubtful_values = warn_once(work, frame.input, work.value_doubts);
    bool doubtful_camera = false;
    if (!is_relative()) {
        const std::filesystem::path described = camera_name(options_, frame);
        warn_once(work, frame.input, work.channel_doubts);
        doubtful_camera |= warn_once(work, described, work.camera.warnings);
        doubtful_camera |= warn_once(work, described, work.camera_doubts);
    }
    warn_once(work, frame.input, work.option_doubts.get());
    if (more_.length_doubts && !work.doubtful_values && !doubtful_camera) // or one mistake would be told twice
        warn_once(work, frame.input, more_.length_doubts(work.subject.stored, work.subject.look, frame));
    frame.said.insert(frame.said.end(), work.explained.begin(), work.explained.end());
    work.subject.look.z.release();
    if (work.failure)
        std::rethrow_exception(work.failure);
    if (!work.rows)
        work.results = operation_(work.subject.stored, frame);
    work.subject.stored.image = {};
    frame.images = {};
    work.depth.values.release();
}

void Steps::write(Work& work) const {
    if (work.kept)
        return;
    const Stopwatch watch(work.times.write);
    const Loaded& frame = work.frame;
    if (work.rows) {
        warn(work, frame.outputs.front(), metadata_doubts(frame.outputs.front(), work.results.front()));
        work.file->complete();
        work.file->take_over();
        return;
    }
    for (std::size_t i = 0; i < outputs_.size() && has_overscan(frame); ++i) {
        fit(work.results[i].image, frame.windows, frame.outputs[i], outputs_[i].product.kind);
        work.results[i].size = work.results[i].image.size();
    }
    if (!work.doubtful_values)
        warn(work, frame.input, png_doubts(options_, outputs_, frame, work.results));
    for (std::size_t i = 0; i < outputs_.size(); ++i)
        warn(work, frame.outputs[i], metadata_doubts(frame.outputs[i], work.results[i]));
    prepare_folders(options_, outputs_, frame);
    const std::vector<ImageFile> files = files_of(options_, outputs_, frame, work.results, work.source);
    const StderrSilenced silenced;
    if (work.record)
        io::write_recorded(files, [&](const auto& bytes) { return records_->text(*work.record, bytes); });
    else
        write_images(files);
}

std::size_t Steps::bytes(const Work& work) const {
    if (work.kept) { // was not read, but says for all how much one takes
        Work other;
        static_cast<Job&>(other.frame) = work.frame;
        try {
            load(other);
        } catch (...) { // nobody knows, so that frames are done one by one
            return std::numeric_limits<std::size_t>::max();
        }
        return bytes(other);
    }
    const auto of = [](const cv::Mat& image) { return image.total() * image.elemSize(); };
    if (work.rows)
        return strip_bytes();
    std::size_t sum = of(work.depth.values);
    try {
        const Images& images = work.frame.images.get();
        sum += of(images.picture.color) + of(images.clean_plate.color) + of(images.clean_plate_depth.values) +
               of(images.normals) + of(images.thickness);
    } catch (...) { // is told when the frame is computed
    }
    std::size_t values = 1; // a pixel: what it looks at
    for (const Output& output : outputs_)
        values += 2 * output.product.channels.size(); // the result and its file
    return sum + values * sizeof(float) * work.depth.values.total();
}

void Steps::check_append(const Work& work) const {
    if (!options_.append || work.source)
        return;
    const Job& job = work.frame;
    if (is_relative() && !more_.picture)
        throw Error(fmt::format("{}: --append does not go with --relative; leave --append out", job.input.native()));
    throw Error(fmt::format("{}: is no OpenEXR file, and --append adds to one; leave --append out",
                            (more_.picture ? job.companions[*more_.picture] : job.input).native()));
}

void Steps::warn(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said) const {
    for (const std::string& doubt : said) {
        const std::string line = fmt::format("{}: {}", subject.native(), doubt);
        if (options_.strict)
            throw Error(line);
        work.frame.said.push_back("warning: " + line);
    }
}

// A camera's mistake is told once for all inputs. Gives whether there is one.
bool Steps::warn_once(Work& work, const std::filesystem::path& subject, const std::vector<std::string>& said) {
    for (const std::string& doubt : said)
        if (options_.strict || subject == work.frame.input || told_.insert(subject.native() + doubt).second)
            warn(work, subject, {doubt});
    return !said.empty();
}

// What went wrong with an input, in a line.
std::string in_words(const std::exception_ptr& failure, const DepthOptions& options, const Job& job) {
    try {
        std::rethrow_exception(failure);
    } catch (const std::bad_alloc&) {
        return about(job.input, "not enough memory for an image of this size; crop it or split it");
    } catch (const ImageTooLarge& error) {
        return about(job.input, error.what() + std::string("; crop it or split it"));
    } catch (const std::invalid_argument& error) { // a field of the camera
        return about(options.relative.order ? job.input : camera_name(options, job), error.what(), {job.input});
    } catch (const std::exception& error) {
        return about(job.input, error.what(), job.others());
    }
}

// A frame that is left out.
void announce_skipped(Report report, const Job& job) {
    if (report == Report::line)
        fmt::print("frame {}  left out: {} is not there\n", *job.frame, job.missing.native());
    if (report == Report::json)
        print_json({{"frame", *job.frame}, {"missing", job.missing.native()}, {"skipped", true}});
    flush_output();
}

// Does no frame have a place because this one has none? Folders that are not there yet are made in those that are.
bool has_no_place(const std::exception_ptr& failure, const Job& job, const std::vector<Job>& jobs) {
    const auto place = [](const std::filesystem::path& file) {
        std::error_code ignored;
        std::filesystem::path folder = file.parent_path();
        while (folder.has_relative_path() && !std::filesystem::exists(folder, ignored))
            folder = folder.parent_path();
        return folder;
    };
    try {
        if (failure)
            std::rethrow_exception(failure);
    } catch (const io::UnwritableFolder&) {
        return std::ranges::all_of(jobs, [&](const Job& other) {
            return std::ranges::equal(other.outputs, job.outputs, {}, place, place) || !other.missing.empty();
        });
    } catch (...) {
    }
    return false;
}

// What is said on stdout, which a log there has for itself.
Report report_of(const DepthOptions& options) {
    if (options.log != "-")
        return options.report;
    const bool openjd = options.progress == ProgressKind::openjd;
    if (options.report == Report::json || openjd)
        throw UsageError(
            fmt::format("--log -: stdout has the lines of {} already; name a file, or leave one of them out",
                        openjd ? "--progress openjd" : "--json"));
    return Report::nothing;
}

// Of many inputs, the errors of a few are far above the last line.
void list_failed(const std::vector<std::string>& failed, std::size_t count) {
    constexpr std::size_t most = 10;
    if (failed.empty() || count == 1)
        return;
    const std::size_t more = failed.size() > most ? failed.size() - most : 0;
    complain(fmt::format("{} of {} inputs failed: {}{}", failed.size(), count,
                         fmt::join(failed.begin(), failed.end() - static_cast<std::ptrdiff_t>(more), ", "),
                         more > 0 ? fmt::format(" and {} more", more) : ""));
}

} // namespace

int each_depth(const DepthOptions& options, const Product& product, const More& more, const Operation& operation) {
    const Report said = report_of(options);
    std::vector<Output> outputs{{"-o", options.output, product}};
    outputs.insert(outputs.end(), more.outputs.begin(), more.outputs.end());
    const std::vector<Job> jobs = plan(options, outputs, more.companions);
    if (!options.relative.order) { // what is wrong for all inputs is told once
        std::vector<Input> read_as(jobs.size());
        std::ranges::transform(jobs, read_as.begin(), &Job::read_as);
        options.camera.read(std::move(read_as));
    }
    catch_interrupts();
    const Device device = options.device.open(options.memory);
    const bool apart = options.device.takes_turns(device);
    if (apart)
        options.device.share_among(jobs.size());
    Steps steps(options, outputs, more, operation, device, apart);
    RunLog log(options.log); // an empty one would say of no run
    if (options.resume)
        remove_abandoned(jobs);
    log.begin({{"kernels", kernels_hash()}, {"device", device_class(device)}, {"frames", jobs.size()}});
    const auto is_skipped = [&](std::size_t i) {
        return !jobs[i].missing.empty() && options.inputs.missing == Missing::skip;
    };
    std::vector<std::size_t> wanted;
    for (std::size_t i = 0; i < jobs.size(); ++i)
        if (!is_skipped(i))
            wanted.push_back(i);
    Progress progress(options.progress, wanted.size(), options.report == Report::nothing);
    std::size_t told = 0; // jobs of which the user has heard
    const auto tell_skipped = [&](std::size_t end) {
        for (; told < end; ++told)
            if (is_skipped(told)) {
                announce_skipped(said, jobs[told]);
                log.add({{"status", "left out"},
                         {"input", jobs[told].input.native()},
                         {"frame", *jobs[told].frame},
                         {"missing", jobs[told].missing.native()}});
            }
    };
    std::vector<std::string> failed;
    std::atomic<bool> no_place = false; // can no result be written?
    const auto report = [&](std::size_t n, Work& work, const std::exception_ptr& failure) {
        const Job& job = jobs[wanted[n]];
        progress.hide();
        tell_skipped(wanted[n]);
        told = wanted[n] + 1;
        for (const std::string& line : work.frame.said)
            complain(line);
        std::string error;
        if (failure) {
            error = in_words(failure, options, job);
            const bool alike = has_no_place(failure, job, jobs);
            if (alike && jobs.size() > 1)
                error += "; no other frame has a place either";
            if (!alike || !no_place.exchange(true))
                complain(error);
            failed.push_back(job.held ? fmt::format("{} (for frame {})", job.input.native(), *job.frame)
                                      : job.input.native());
        } else {
            announce(said, outputs, work);
        }
        log.add(log_line(outputs, work, error));
        progress.advance();
    };
    const std::size_t begun =
        for_each_frame<Work>(wanted.size(),
                             {.read =
                                  [&](std::size_t n, Work& work) {
                                      static_cast<Job&>(work.frame) = jobs[wanted[n]];
                                      steps.read(work);
                                  },
                              .compute = [&](std::size_t, Work& work) { steps.compute(work); },
                              .write = [&](std::size_t, Work& work) { steps.write(work); },
                              .report = report,
                              .bytes = [&](const Work& work) { return steps.bytes(work); }},
                             {.threads = options.device.threads, .apart = apart, .memory = options.memory, .stop = [&] {
                                  return is_interrupted() || no_place;
                              }});
    progress.hide();
    if (!no_place)
        list_failed(failed, wanted.size());
    if (begun < wanted.size())
        stop_if_interrupted();
    if (!no_place)
        tell_skipped(jobs.size());
    return failed.empty() && log.complete() ? done : input_failed;
}

bool has_overscan(const Job& job) {
    return job.windows.data != cv::Rect({0, 0}, job.windows.display);
}

void check_same_pixels(const std::filesystem::path& file, const DepthFile& other, const Job& job) {
    check_same_size(file, other.values.size(), job);
    if (other.windows != job.windows)
        throw Error(fmt::format("{}: has other data and display windows than {}; write both with the same ones",
                                file.native(), job.input.native()));
}

void check_same_size(const std::filesystem::path& file, cv::Size size, const Job& job) {
    const auto& [width, height] = job.windows.data.size();
    if (size.width != width || size.height != height)
        throw Error(fmt::format("{}: is {} × {}, but {} is {} × {}; both must be of the same size", file.native(),
                                size.width, size.height, job.input.native(), width, height));
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
