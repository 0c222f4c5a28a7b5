// What comes out of an input: its images, their files and what those cannot hold; what is said of it, in a line for people, as JSON and
// in --log; and what makes a result, as the line of JSON by which --resume knows it. In a log lines of several processes do not mix: a
// file that is opened to append to takes each write whole.
#include "work.hpp"

#include "camera/photograph.hpp"
#include "runtime/state.hpp"
#include "text.hpp"

#include <fathom/error.hpp>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <opencv2/core.hpp>

#include <algorithm>
#include <iterator>
#include <limits>
#include <new>
#include <system_error>

#include <unistd.h>

namespace fathom::shot {
namespace {

using nlohmann::ordered_json;

std::vector<std::string> command_line; // that the program was started with

// The names of the channels that an image has: an alpha may be missing.
std::vector<std::string> channels_of(const Product& product, const cv::Mat& image) {
    const auto there = std::min(product.channels.size(), static_cast<std::size_t>(image.channels()));
    return {product.channels.begin(), product.channels.begin() + static_cast<std::ptrdiff_t>(there)};
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

// The files of a job's results, in the order of the outputs.
// Throws: Error for a result of another size that is to be appended.
std::vector<ImageFile> files_of(const DepthOptions& options, const Job& job, const std::vector<Made>& results,
                                const std::optional<ExrSource>& source) {
    std::vector<ImageFile> images;
    for (std::size_t i = 0; i < options.outputs.size(); ++i) {
        const Product& product = options.outputs[i].product;
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
            for (std::string& channel : how.channels) // such as "linear" in front of Z, which a depth image has already
                channel.insert(0, product.layer.empty() ? "" : product.layer + ".");
        }
        how.channels = known_names(how.channels, i == 0 && options.append);
        images.push_back({job.outputs[i], image, how, product.kind, results[i].format});
    }
    return images;
}

// A --png-scale that cuts values off, or leaves only a few codes to them.
std::vector<std::string> png_doubts(const DepthOptions& options, const Job& job, const std::vector<Made>& results) {
    constexpr double many_cut = 0.01, few_codes = 64;
    std::vector<std::string> said;
    for (std::size_t i = 0; i < options.outputs.size() && options.png_scale; ++i) {
        if (options.outputs[i].product.png_scale.value_or(*options.png_scale) != *options.png_scale ||
            extension_of(job.outputs[i]) != ".png" || results[i].format)
            continue;
        const cv::Mat image = results[i].image.reshape(1);
        const cv::Mat finite = cv::abs(image) < std::numeric_limits<double>::infinity();
        const cv::Mat beyond = finite & (image > 1 / *options.png_scale);
        double largest = 0;
        cv::minMaxIdx(image, nullptr, &largest, nullptr, nullptr, finite);
        const auto values = static_cast<std::size_t>(cv::countNonZero(finite)),
                   cut = static_cast<std::size_t>(cv::countNonZero(beyond));
        const double codes = largest * *options.png_scale * 65535;
        const std::string cure = fmt::format("--png-scale {:.2g} holds all up to {:.4g}", 0.99 / largest, largest);
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
std::vector<std::string> metadata_doubts(const std::filesystem::path& file, const Made& result) {
    if (!result.format)
        return {};
    std::vector<std::string> said;
    if (result.format->incomplete)
        said.emplace_back(
            "does not hold the picture's Exif data or its grey profile, which are not read; copy them with exiftool");
    else if (loses_metadata(file, *result.format))
        said.emplace_back("does not hold the colour profile or the camera's data of the picture; write the picture's "
                          "own type to keep them");
    const std::string extension = extension_of(file);
    if (!result.format->primaries.empty() && (extension == ".jpg" || extension == ".png"))
        said.push_back(fmt::format("counts as sRGB, but the header of the picture says {}, so that its colours look "
                                   "dull; convert the picture to linear sRGB first, or write an .exr",
                                   result.format->primaries));
    return said;
}

// A device: its name, and its driver's.
std::string device_class(const Device& device) {
    std::string driver = runtime::ask_driver([&] { return cl::Device(device.id(), true).getInfo<CL_DRIVER_VERSION>(); },
                                             device.info().name, " does not say the version of its driver");
    driver.resize(std::min(driver.size(), driver.find('\0')));
    return fmt::format("{}, {} {}", device.info().name, device.info().platform, driver);
}

// Opens a log to append to. A file that holds something else is left as it is.
std::ofstream opened_log(const std::string& file) {
    constexpr std::string_view beginning = R"({"run":)"; // a full disk may have left a part of it
    if (std::error_code none; std::filesystem::is_regular_file(file, none)) {
        std::string found(beginning.size(), '\0');
        std::ifstream past(file, std::ios::binary);
        past.read(found.data(), static_cast<std::streamsize>(found.size()));
        if (!beginning.starts_with(std::string_view(found).substr(0, static_cast<std::size_t>(past.gcount()))))
            io::refuse(file, "is no log, and is left as it is; choose another file (--log)");
    }
    std::ofstream log(file, std::ios::binary | std::ios::app);
    if (!log)
        io::refuse_write(file, "the log cannot be written", errno, "choose another file (--log)");
    return log;
}

// Options that change no result, and those of files, whose sizes and times count.
constexpr const char* left_out[] = {"DEPTH",     "--output",  "--camera",  "--format", "--frames",     "--missing",
                                    "--animate", "--device",  "--threads", "--memory", "--progress",   "--json",
                                    "--quiet",   "--explain", "--resume",  "--log",    "--interpolate"};

// Null where there is no file.
ordered_json state_of(const std::filesystem::path& file) {
    const auto state = io::state_of(file);
    return state ? ordered_json{state->size, state->time} : ordered_json();
}

std::string line_of(ordered_json record, const std::vector<io::FileState>& results) {
    for (const auto& [size, time] : results)
        record["outputs"].push_back({size, time});
    return record.dump(-1, ' ', true, ordered_json::error_handler_t::replace) + '\n';
}

// Where the line of a frame lies.
std::filesystem::path record_of(const Job& job) {
    return job.outputs.front().native() + record_ending;
}

// The files of an input for --json and --log, and its frame.
ordered_json files_in_json(const DepthOptions& options, const Job& job, bool has_results) {
    ordered_json line{{"input", job.shown(job.input)}};
    if (has_results && !job.outputs.empty())
        line["output"] = job.outputs.front().native();
    if (job.in_sequence && job.frame)
        line["frame"] = *job.frame;
    for (std::size_t i = 1; has_results && i < job.outputs.size(); ++i) {
        std::string key = options.outputs[i].option.substr(2); // bent_normal for --bent-normal
        std::ranges::replace(key, '-', '_');
        line[key] = job.outputs[i].native();
    }
    return line;
}

std::optional<PictureFormat> written_format(const Job& job, const Made& made) {
    return made.format ? std::optional(format_for(job.outputs.front(), *made.format)) : std::nullopt;
}

ordered_json times_in_json(const Times& times) {
    return {{"seconds", times.whole()},
            {"read_seconds", times.read},
            {"compute_seconds", times.compute},
            {"write_seconds", times.write}};
}

// What --json says of a frame that was done.
ordered_json line_of(const DepthOptions& options, const Work& work) {
    const Job& job = work.frame;
    ordered_json line = files_in_json(options, job, true);
    if (work.kept) {
        line["kept"] = true;
        return line;
    }
    const Made& made = work.results.front();
    line.update({{"width", made.size.width},
                 {"height", made.size.height},
                 {"channels", channels_of(options.outputs.front().product, made.image)}});
    line.update(times_in_json(work.times));
    if (!work.depth_channel.empty())
        line["depth_channel"] = work.depth_channel;
    line.update(work.depth_members);
    if (job.range)
        line["relative_range"] = *job.range;
    if (const auto format = written_format(job, made)) {
        line["color_space"] = to_string(format->encoding);
        line["bits"] = format->bits;
    }
    return line;
}

// The same for the log, which says more.
ordered_json log_line(const DepthOptions& options, const Work& work, const std::string& error) {
    constexpr std::string_view warning = "warning: ";
    ordered_json line{{"status", !error.empty() ? "failed" : work.kept ? "kept" : "made"}};
    line.update(error.empty() ? line_of(options, work) : files_in_json(options, work.frame, true));
    line.update(times_in_json(work.times));
    line.erase("kept");
    line["warnings"] = ordered_json::array();
    for (const std::string& said : work.frame.said)
        if (said.starts_with(warning))
            line["warnings"].push_back(work.frame.shown(said.substr(warning.size())));
    if (!error.empty())
        line["error"] = error;
    if (work.frame.camera)
        line["camera"] = ordered_json::parse(work.frame.camera->text);
    return line;
}

std::string result_in_words(const Work& work) {
    const Job& job = work.frame;
    std::string line;
    for (const std::filesystem::path& file : job.outputs)
        line += (line.empty() ? "" : ", ") + file.native();
    if (work.kept)
        return line + "  kept";
    const Made& made = work.results.front();
    const auto format = written_format(job, made);
    const std::string picture = !format ? ""
                                : format->bits == 32
                                    ? "  linear floats"
                                    : fmt::format("  {}, {} bits", to_string(format->encoding), format->bits);
    const std::string channel = work.depth_channel.empty() ? "" : io::printable(work.depth_channel) + ": ";
    return fmt::format("{}  {} × {}{}  {}{}  {:.0f} ms", line, made.size.width, made.size.height, picture, channel,
                       work.depth_words, work.times.whole() * 1e3);
}

// What went wrong with an input, in a line.
std::string in_words(const std::exception_ptr& failure, const DepthOptions& options, const Job& job) {
    try {
        std::rethrow_exception(failure);
    } catch (const NoDevice&) { // which fails for all inputs alike, and ends the run
        throw;
    } catch (const std::bad_alloc&) {
        return about(job.input, "not enough memory for an image of this size; crop it or split it");
    } catch (const ImageTooLarge& error) {
        return about(job.input, error.what() + std::string("; crop it or split it"));
    } catch (const std::invalid_argument& error) { // a field of the camera
        return about(options.relative ? job.input : job.camera_name, error.what(), {job.input});
    } catch (const std::exception& error) {
        std::vector<std::filesystem::path> others = job.companions;
        others.insert(others.end(), job.outputs.begin(), job.outputs.end());
        return about(job.input, error.what(), others);
    }
}

} // namespace

std::vector<std::string> known_names(std::vector<std::string> channels, bool append) {
    const std::vector<std::string> own = channels;
    const std::size_t end = own.front().rfind('.') + 1;
    if (append && own.front().size() == end + 1)
        for (const std::string& name : own)
            channels.push_back("Fathom." + name);
    else if (append)
        for (const char* color : {".R", ".G", ".B"})
            for (const std::string& name : own)
                channels.push_back("Fathom." + name.substr(end) + color);
    else if (end == 0 && own.front() != "R")
        channels.emplace_back("Y");
    return channels;
}

bool is_exr(const std::filesystem::path& file) {
    return io::is_file(file) && !list_channels(file).empty();
}

void find_source(const DepthOptions& options, Work& work) {
    const Job& job = work.frame;
    work.windows = job.windows;
    if (!work.depth.channel.empty())
        work.source = ExrSource{job.input, work.depth.channel, work.depth.windows};
    if (!options.made_of_picture || !is_exr(job.companions.front()))
        return;
    const std::filesystem::path& file = job.companions.front();
    const std::string channel = color_channels(file, options.picture.layer).front();
    work.source = ExrSource{file, channel, job.windows};
    const Windows picture = io::exr_windows(file, channel);
    const cv::Rect both = job.windows.data & picture.data;
    if (picture.display != job.windows.display)
        return;
    if (both.empty())
        io::refuse(file, "has no pixel within the data window of the depth, " + job.input.string() +
                             "; give a picture of the same view");
    work.windows = {both, picture.display};
}

void warn(const DepthOptions& options, Work& work, const std::filesystem::path& subject,
          const std::vector<std::string>& said) {
    for (const std::string& doubt : said) {
        const std::string line = fmt::format("{}: {}", subject.native(), doubt);
        if (options.strict)
            throw Error(line);
        work.frame.said.push_back("warning: " + line);
    }
}

void write_results(const DepthOptions& options, const Records* records, Work& work) {
    const Job& frame = work.frame;
    const bool is_cut = work.windows != frame.windows;
    for (std::size_t i = 0; i < options.outputs.size() && (is_cut || has_overscan(work.windows)); ++i) {
        Made& result = work.results[i];
        if (is_cut) {
            result.part = work.windows.data - frame.windows.data.tl();
            result.image = result.image(*result.part).clone();
        }
        fit(result.image, work.windows, frame.outputs[i], options.outputs[i].product.kind);
        result.size = result.image.size();
    }
    if (!work.doubtful_values)
        warn(options, work, frame.input, png_doubts(options, frame, work.results));
    for (std::size_t i = 0; i < options.outputs.size(); ++i)
        warn(options, work, frame.outputs[i], metadata_doubts(frame.outputs[i], work.results[i]));
    prepare_folders(options, frame);
    std::vector<ImageFile> files = files_of(options, frame, work.results, work.source);
    if (options.output == standard_stream) {
        work.raw = io::raw_bytes(files.front(), result_format(options));
        files.erase(files.begin());
    }
    io::write_images_and(files, records ? records->file_of(work.record, frame) : io::LastFile{});
}

void remember_command_line(int argc, char** argv) {
    command_line.assign(argv, argv + argc);
}

Records::Records(const DepthOptions& options, const Device& device) : options_(options) {
    auto counted = options.given();
    for (const char* option : left_out)
        counted.erase(option);
    for (const Output& output : options.outputs)
        counted.erase(output.option);
    for (const Companion& companion : options.companions)
        counted.erase(companion.option);
    for (const Animation& animation : options.animations)
        counted.erase(animation.option);
    common_ = {{"fathom", FATHOM_VERSION},
               {"kernels", kernels_hash()},
               {"device", device_class(device)},
               {"command", options.command},
               {"options", counted}};
}

ordered_json Records::of(const Job& job) const {
    ordered_json record = common_;
    record["inputs"]["depth"] = state_of(job.input);
    for (std::size_t i = 0; i < job.values.size(); ++i)
        record["values"][options_.animations[i].option] = job.values[i];
    for (std::size_t i = 0; i < job.companions.size(); ++i)
        record["inputs"][options_.companions[i].option] = state_of(job.companions[i]);
    for (const std::filesystem::path& file : options_.camera.files_for(job.read_as()))
        record["inputs"]["camera"].push_back(state_of(file));
    if (job.camera) // a file may hold many, and the name of the depth chooses one
        record["camera"] = io::digest(job.camera->text);
    if (job.range)
        record["range"] = *job.range;
    return record;
}

bool Records::is_finished(const ordered_json& record, const Job& job) const {
    std::vector<io::FileState> results;
    for (const std::filesystem::path& output : job.outputs) {
        const auto state = io::state_of(output);
        if (!state)
            return false;
        results.push_back(*state);
    }
    std::ifstream stream(record_of(job), std::ios::binary);
    try {
        return std::string{std::istreambuf_iterator<char>(stream), {}} == line_of(record, results);
    } catch (const std::ios_base::failure&) { // a line that cannot be read keeps nothing
        return false;
    }
}

io::LastFile Records::file_of(const ordered_json& record, const Job& job) const {
    return [record, file = record_of(job)](const std::vector<io::FileState>& results) {
        const std::string line = line_of(record, results);
        return io::NewFile{file, io::Bytes(line.begin(), line.end())};
    };
}

Report report_of(const DepthOptions& options) {
    const bool pixels = options.output == standard_stream, log = options.log == standard_stream;
    if (!pixels && !log)
        return options.report;
    const char* other = options.report == Report::json             ? "--json"
                        : options.progress == ProgressKind::openjd ? "--progress openjd"
                        : pixels && log                            ? "--log -"
                                                                   : nullptr;
    if (other)
        throw UsageError(fmt::format("{}, which {} would mix with lines; leave one of the two out",
                                     pixels ? "-o -: stdout has the pixels" : "--log -: stdout has the log", other));
    return Report::nothing;
}

void announce_failure(Report report, const Job& job, const std::string& error) {
    if (report != Report::json)
        return;
    ordered_json line = files_in_json({}, job, false);
    line["error"] = error;
    print_json(line);
    flush_output();
}

Telling::Telling(const DepthOptions& options, Report said, const std::vector<Job>& jobs, const Device& device,
                 const std::vector<std::string>& lines)
    : options_(options), said_(said), count_(static_cast<std::size_t>(std::ranges::count(jobs, false, &Job::left_out))),
      progress_(options.progress, options.inputs.is_piped() ? 0 : count_, said == Report::nothing) {
    if (!options.log.empty() && options.log != standard_stream)
        log_ = opened_log(options.log);
    const auto now = std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
    std::error_code none;
    log({{"run",
          {{"command", command_line},
           {"folder", std::filesystem::current_path(none).native()},
           {"version", FATHOM_VERSION},
           {"host", io::host_name()},
           {"process", ::getpid()},
           {"started", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now))},
           {"kernels", kernels_hash()},
           {"device", device_class(device)},
           {"frames", jobs.size()}}}});
    for (const std::string& line : lines)
        if (said == Report::line)
            fmt::print("{}\n", line);
    flush_output();
}

// A disk that is full is told once, and ends the log.
void Telling::log(const ordered_json& line) {
    if (options_.log == standard_stream) {
        print_json(line);
        flush_output();
    } else if (log_.is_open()) {
        log_ << json_line(line) << std::flush;
        if (log_)
            return;
        complain(options_.log + ": the log cannot be written: " + io::reason(errno) +
                 "; it ends here, and the frames are done without it");
        is_log_complete_ = false;
        log_.close();
    }
}

void Telling::tell_left_out(const Job& job) {
    if (said_ == Report::line)
        fmt::print("frame {}  left out: {} is not there\n", *job.frame, job.missing.native());
    if (said_ == Report::json)
        print_json({{"frame", *job.frame}, {"missing", job.missing.native()}, {"skipped", true}});
    flush_output();
    log({{"status", "left out"},
         {"input", job.input.native()},
         {"frame", *job.frame},
         {"missing", job.missing.native()}});
    progress_.show();
}

void Telling::tell(const Work& work, const std::exception_ptr& failure) {
    const Job& job = work.frame;
    progress_.hide();
    if (job.left_out)
        return tell_left_out(job);
    for (const std::string& said : job.said)
        complain(job.shown(said));
    std::string error;
    if (failure) {
        error = job.shown(in_words(failure, options_, job));
        complain(error);
        announce_failure(said_, job, error);
        failed_.push_back(job.shown(job.input.native()));
    } else {
        if (said_ == Report::line)
            fmt::print("{}\n", result_in_words(work));
        if (said_ == Report::json)
            print_json(line_of(options_, work));
        flush_output();
    }
    log(log_line(options_, work, error));
    progress_.advance();
}

// Of many inputs, the errors of a few are far above the last line.
bool Telling::sum_up() {
    constexpr std::size_t most = 10;
    progress_.hide();
    const std::size_t named = std::min(most, failed_.size()), more = failed_.size() - named;
    if (!failed_.empty() && count_ > 1)
        complain(fmt::format("{} of {} inputs failed: {}{}", failed_.size(), count_,
                             fmt::join(failed_.begin(), failed_.begin() + static_cast<std::ptrdiff_t>(named), ", "),
                             more > 0 ? fmt::format(" and {} more", more) : ""));
    return failed_.empty() && is_log_complete_;
}

} // namespace fathom::shot
