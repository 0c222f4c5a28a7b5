// What the program prints: one line for an error, one for a result, for people or as JSON; and how far it is.
#include "messages.hpp"

#include "exit.hpp"

#include "camera_file/file.hpp"
#include "camera_file/known_words.hpp"
#include "description/range.hpp"
#include "text.hpp"

#include <fmt/format.h>

#include <opencv2/core/utils/logger.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace fathom::terminal {
namespace {

std::string on_one_line(std::string_view text) {
    std::string line;
    for (const char c : text) {
        const bool blank = static_cast<unsigned char>(c) <= ' ' || c == '\x7f';
        if (!blank)
            line += c;
        else if (!line.empty() && line.back() != ' ')
            line += ' ';
    }
    while (line.ends_with(' '))
        line.pop_back();
    return line;
}

void write_to_stderr(std::string_view text) {
    while (!text.empty()) {
        const auto written = ::write(STDERR_FILENO, text.data(), text.size());
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return;
        text.remove_prefix(static_cast<std::size_t>(written));
    }
}

int output_error = 0; // the first

} // namespace

void flush_output() {
    errno = 0;
    if (std::fflush(stdout) != 0 && output_error == 0)
        output_error = errno;
    if (output_error == EPIPE)
        interrupt(SIGPIPE);
}

void check_output() {
    flush_output();
    if (output_error == EPIPE)
        throw Interrupted{SIGPIPE};
    if (output_error != 0 || std::ferror(stdout) != 0)
        throw Error(unwritable_output(output_error));
}

void print_bytes(std::span<const unsigned char> bytes) {
    errno = 0;
    if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) < bytes.size() && output_error == 0)
        output_error = errno;
    check_output();
}

std::string unwritable_output(int error) {
    const std::string why = error == 0 ? "" : ": " + io::reason(error);
    return "standard output: cannot be written" + why + "; check what it is sent to";
}

void complain(std::string_view message) {
    write_to_stderr("fathom: " + io::printable(on_one_line(message)) + '\n');
}

std::string about(const std::filesystem::path& subject, std::string_view message,
                  const std::vector<std::filesystem::path>& already_named) {
    const auto names = [&](const std::filesystem::path& file) {
        return !file.empty() && message.find(file.native()) != std::string_view::npos;
    };
    if (names(subject) || std::any_of(already_named.begin(), already_named.end(), names))
        return std::string(message);
    return subject.native() + ": " + std::string(message);
}

void print_json(const nlohmann::ordered_json& value) {
    fmt::print("{}\n", value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

nlohmann::ordered_json json_number(double value) {
    if (std::isnan(value))
        return "nan";
    if (std::isinf(value))
        return value > 0 ? "inf" : "-inf";
    return value;
}

std::string number(double value) {
    return fmt::format("{:.7g}", value);
}

std::string nearest(std::string_view name, const std::vector<std::string>& known) {
    const std::vector<std::string> best = io::nearest_words(known, name, 1);
    const std::size_t most_edits = std::max<std::size_t>(2, name.size() / 3);
    return best.empty() || io::edit_distance(name, best.front()) > most_edits ? "" : best.front();
}

std::string one_of(const std::vector<std::string>& names) {
    return description::in_words(names);
}

std::string in_words(const Look& look, const char* depth) {
    std::string text =
        look.surfaces() == 0 ? "no surface" : fmt::format("{} {:.4g} to {:.4g}", depth, look.nearest, look.farthest);
    if (look.background > 0)
        text += fmt::format(", {} background", percent(look.background, look.pixels));
    return text + ", " + invalid_in_words(look.invalid, look.pixels);
}

std::string invalid_in_words(std::size_t invalid, std::size_t pixels) {
    return fmt::format("{} of {} pixels invalid", invalid, pixels) +
           (invalid > 0 ? fmt::format(" ({})", percent(invalid, pixels)) : "");
}

// The program's streams.

void prepare_streams() {
    // Each the other way round, so that what is read from it or printed there fails, as through a closed one.
    for (const int file : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(file, F_GETFD) < 0)
            open("/dev/null", file == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
}

// It is the last line of the terminal. Whatever else is printed takes its place first.

namespace {

bool is_terminal() {
    const char* kind = std::getenv("TERM");
    return isatty(STDERR_FILENO) && kind && std::string_view(kind) != "dumb";
}

std::size_t columns() {
    winsize size{};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

// "0:48", "1:02:03".
std::string in_minutes(double seconds) {
    const auto whole = std::llround(std::min(seconds, 1e9));
    const auto hours = whole / 3600, minutes = whole / 60 % 60;
    return hours > 0 ? fmt::format("{}:{:02}:{:02}", hours, minutes, whole % 60)
                     : fmt::format("{}:{:02}", minutes, whole % 60);
}

} // namespace

Progress::Progress(ProgressKind kind, std::size_t count, bool quiet)
    : count_(count), bar_(kind == ProgressKind::automatic && count > 1 && !quiet && is_terminal()),
      openjd_(kind == ProgressKind::openjd) {}

void Progress::hide() {
    if (shown_)
        write_to_stderr("\r\x1b[K");
    shown_ = false;
}

void Progress::advance() {
    const auto now = std::chrono::steady_clock::now();
    ++done_;
    if (done_ == 1)
        first_ = now;
    if (!bar_ && !openjd_)
        return;
    // The first frame is slow: kernels are compiled and nothing overlaps yet.
    const double passed = std::chrono::duration<double>(now - (done_ > 1 ? first_ : start_)).count();
    const double rate = static_cast<double>(std::max<std::size_t>(done_ - 1, 1)) / std::max(passed, 1e-9);
    const std::string text = fmt::format("{} of {}  {:.3g} frames/s  {} left", done_, count_, rate,
                                         in_minutes(static_cast<double>(count_ - done_) / rate));
    if (openjd_) {
        fmt::print("openjd_progress: {:.1f}\nopenjd_status: {}\n",
                   100 * static_cast<double>(done_) / static_cast<double>(count_), text);
        flush_output();
        return;
    }
    write_to_stderr("\r\x1b[K" + text.substr(0, columns() - 1));
    shown_ = true;
}

} // namespace fathom::terminal
