// What a run says: a line for each input, for people and as JSON, and --log. There lines of several processes do not mix: a file that
// is opened to append to takes each write whole.
#include "telling.hpp"

#include "each_depth.hpp"

#include "camera_file/file.hpp"
#include "io/replace_files.hpp"
#include "terminal/exit.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include <unistd.h>

namespace fathom::shot {
namespace {

std::vector<std::string>& command_line() {
    static std::vector<std::string> arguments;
    return arguments;
}

} // namespace

void remember_command_line(int argc, char** argv) {
    command_line().assign(argv, argv + argc);
}

RunLog::RunLog(const std::string& file) : file_(file) {
    if (file.empty() || file == standard_stream)
        return;
    constexpr std::string_view beginning = R"({"run":)"; // a full disk may have left a part of it
    if (std::error_code none; std::filesystem::is_regular_file(file, none)) {
        std::string found(beginning.size(), '\0');
        std::ifstream past(file, std::ios::binary);
        past.read(found.data(), static_cast<std::streamsize>(found.size()));
        if (!beginning.starts_with(std::string_view(found).substr(0, static_cast<std::size_t>(past.gcount()))))
            io::refuse(file, "is no log, and is left as it is; choose another file (--log)");
        past.clear();
        past.seekg(-1, std::ios::end);
        is_cut_ = past && past.get() != '\n';
    }
    stream_.open(file, std::ios::binary | std::ios::app);
    if (!stream_)
        io::refuse_write(file, "the log cannot be written", errno, "choose another file (--log)");
}

void RunLog::begin(const nlohmann::ordered_json& more) {
    const auto now = std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
    std::error_code none;
    nlohmann::ordered_json run{
        {"command", command_line()}, {"folder", std::filesystem::current_path(none).native()},
        {"version", FATHOM_VERSION}, {"host", io::host_name()},
        {"process", ::getpid()},     {"started", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now))}};
    run.update(more);
    if (is_cut_)
        stream_ << '\n';
    add({{"run", run}});
}

void RunLog::add(const nlohmann::ordered_json& line) {
    if (file_ == standard_stream) {
        print_json(line);
        flush_output();
    } else if (stream_.is_open()) {
        stream_ << line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n' << std::flush;
        if (stream_)
            return;
        complain(file_ + ": the log cannot be written: " + io::reason(errno) +
                 "; it ends here, and the frames are done without it");
        complete_ = false;
        stream_.close();
    }
}

namespace {

// An option as a key of JSON: bent_normal for --bent-normal.
std::string key_of(const std::string& option) {
    std::string key = option.substr(option.find_first_not_of('-'));
    std::replace(key.begin(), key.end(), '-', '_');
    return key;
}

// The files of an input for --json and --log, and its frame.
nlohmann::ordered_json files_in_json(const DepthOptions& options, const Job& job, bool has_results) {
    nlohmann::ordered_json line{{"input", job.shown(job.input)}};
    if (has_results && !job.outputs.empty())
        line["output"] = job.outputs.front().native();
    if (job.in_sequence && job.frame)
        line["frame"] = *job.frame;
    for (std::size_t i = 1; has_results && i < job.outputs.size(); ++i)
        line[key_of(options.outputs[i].option)] = job.outputs[i].native();
    return line;
}

std::optional<PictureFormat> written_format(const Job& job, const Made& made) {
    return made.format ? std::optional(format_for(job.outputs.front(), *made.format)) : std::nullopt;
}

nlohmann::ordered_json times_in_json(const Times& times) {
    return {{"seconds", times.whole()},
            {"read_seconds", times.read},
            {"compute_seconds", times.compute},
            {"write_seconds", times.write}};
}

// What --json says of a frame that was done.
nlohmann::ordered_json line_of(const DepthOptions& options, const Work& work) {
    const Job& job = work.frame;
    nlohmann::ordered_json line = files_in_json(options, job, true);
    if (work.kept) {
        line["kept"] = true;
        return line;
    }
    const Made& made = work.results.front();
    line.update({{"width", made.size.width},
                 {"height", made.size.height},
                 {"channels", channels_of(options.outputs.front().product, made.image)}});
    line.update(times_in_json(work.times));
    if (!work.held.channel.empty())
        line["depth_channel"] = work.held.channel;
    line.update(work.held.members);
    if (job.range)
        line["relative_range"] = *job.range;
    if (const auto format = written_format(job, made)) {
        line["color_space"] = to_string(format->encoding);
        line["bits"] = format->bits;
    }
    return line;
}

// The same for the log, which says more.
nlohmann::ordered_json log_line(const DepthOptions& options, const Work& work, const std::string& error) {
    constexpr std::string_view warning = "warning: ";
    nlohmann::ordered_json line{{"status", !error.empty() ? "failed" : work.kept ? "kept" : "made"}};
    line.update(error.empty() ? line_of(options, work) : files_in_json(options, work.frame, true));
    line.update(times_in_json(work.times));
    line.erase("kept");
    line["warnings"] = nlohmann::ordered_json::array();
    for (const std::string& said : work.frame.said)
        if (said.starts_with(warning))
            line["warnings"].push_back(work.frame.shown(said.substr(warning.size())));
    if (!error.empty())
        line["error"] = error;
    if (work.frame.camera)
        line["camera"] = nlohmann::ordered_json::parse(work.frame.camera->text);
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
    const Held& depth = work.held;
    const std::string channel = depth.channel.empty() ? "" : io::printable(depth.channel) + ": ";
    return fmt::format("{}  {} × {}{}  {}{}  {:.0f} ms", line, made.size.width, made.size.height, picture, channel,
                       depth.words, work.times.whole() * 1e3);
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
        return about(options.relative.order ? job.input : job.camera_name, error.what(), {job.input});
    } catch (const std::exception& error) {
        return about(job.input, error.what(), job.others());
    }
}

} // namespace

Report report_of(const DepthOptions& options) {
    if (options.output == standard_stream) {
        const char* other = options.report == Report::json             ? "--json"
                            : options.log == standard_stream           ? "--log -"
                            : options.progress == ProgressKind::openjd ? "--progress openjd"
                                                                       : nullptr;
        if (other)
            throw UsageError(
                fmt::format("-o -: stdout has the pixels, which {} would mix with lines; leave it out", other));
        return Report::nothing;
    }
    if (options.log != "-")
        return options.report;
    const bool openjd = options.progress == ProgressKind::openjd;
    if (options.report == Report::json || openjd)
        throw UsageError(
            fmt::format("--log -: stdout has the lines of {} already; name a file, or leave one of them out",
                        openjd ? "--progress openjd" : "--json"));
    return Report::nothing;
}

void announce_failure(Report report, const Job& job, const std::string& error) {
    if (report != Report::json)
        return;
    nlohmann::ordered_json line = files_in_json({}, job, false);
    line["error"] = error;
    print_json(line);
    flush_output();
}

Telling::Telling(const DepthOptions& options, const std::vector<Job>& jobs, const Device& device)
    : options_(options), jobs_(jobs), said_(report_of(options)),
      count_(static_cast<std::size_t>(std::ranges::count(jobs, false, &Job::left_out))), log_(options.log),
      progress_(options.progress, options.inputs.is_piped() ? 0 : count_, said_ == Report::nothing) {
    log_.begin({{"kernels", kernels_hash()}, {"device", device_class(device)}, {"frames", jobs.size()}});
}

void Telling::begin(const std::vector<std::string>& lines) const {
    for (const std::string& line : lines)
        if (said_ == Report::line)
            fmt::print("{}\n", line);
    flush_output();
}

void Telling::tell_left_out(std::size_t end) {
    for (; told_ < std::min(end, jobs_.size()); ++told_) {
        const Job& job = jobs_[told_];
        if (!job.left_out)
            continue;
        if (said_ == Report::line)
            fmt::print("frame {}  left out: {} is not there\n", *job.frame, job.missing.native());
        if (said_ == Report::json)
            print_json({{"frame", *job.frame}, {"missing", job.missing.native()}, {"skipped", true}});
        flush_output();
        log_.add({{"status", "left out"},
                  {"input", job.input.native()},
                  {"frame", *job.frame},
                  {"missing", job.missing.native()}});
    }
}

void Telling::tell(std::size_t index, const Work& work, const std::exception_ptr& failure) {
    const Job& job = work.frame;
    progress_.hide();
    tell_left_out(index);
    told_ = index + 1;
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
    log_.add(log_line(options_, work, error));
    progress_.advance();
}

// Of many inputs, the errors of a few are far above the last line.
void Telling::sum_up() {
    constexpr std::size_t most = 10;
    progress_.hide();
    if (failed_.empty() || count_ == 1)
        return;
    const std::size_t named = std::min(most, failed_.size()), more = failed_.size() - named;
    complain(fmt::format("{} of {} inputs failed: {}{}", failed_.size(), count_,
                         fmt::join(failed_.begin(), failed_.begin() + static_cast<std::ptrdiff_t>(named), ", "),
                         more > 0 ? fmt::format(" and {} more", more) : ""));
}

bool Telling::finish() {
    tell_left_out(jobs_.size());
    return failed_.empty() && log_.complete();
}

} // namespace fathom::shot
