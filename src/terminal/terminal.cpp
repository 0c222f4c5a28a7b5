// What the program prints: one line for an error, one for a result, for people or as JSON; and how far it is.
#include "terminal.hpp"

#include "camera_file/file.hpp"
#include "camera_file/known_words.hpp"
#include "description/range.hpp"
#include "text.hpp"

#include <fmt/format.h>

#include <opencv2/core/utils/logger.hpp>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <system_error>
#include <thread>

#include <fcntl.h>
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

bool is_terminal() {
    const char* kind = std::getenv("TERM");
    return isatty(STDERR_FILENO) && kind && std::string_view(kind) != "dumb";
}

// "0:48", "1:02:03".
std::string in_minutes(double seconds) {
    const auto whole = std::llround(std::min(seconds, 1e9));
    const auto hours = whole / 3600, minutes = whole / 60 % 60;
    return hours > 0 ? fmt::format("{}:{:02}:{:02}", hours, minutes, whole % 60)
                     : fmt::format("{}:{:02}", minutes, whole % 60);
}

std::atomic<bool> asks = false; // the first signal only asks
std::atomic<int> received = 0;

[[noreturn]] void wait_for(const sigset_t& signals, void (*last)()) {
    for (;;) {
        int signal = 0;
        if (sigwait(&signals, &signal) != 0)
            continue;
        if (asks && received.exchange(signal) == 0)
            continue;
        last();
        std::signal(signal, SIG_DFL);
        pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
        kill(getpid(), signal);
    }
}

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

std::string json_line(const nlohmann::ordered_json& value) {
    return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

void print_json(const nlohmann::ordered_json& value) {
    fmt::print("{}", json_line(value));
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

std::string did_you_mean(std::string_view name, const std::vector<std::string>& known, const std::string& otherwise) {
    const std::vector<std::string> best = io::nearest_words(known, name, 1);
    return !best.empty() && io::is_near(best.front(), name) ? "did you mean " + best.front() + "?" : otherwise;
}

std::string one_of(const std::vector<std::string>& names) {
    return description::in_words(names);
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

Progress::Progress(ProgressKind kind, std::size_t count, bool quiet)
    : count_(count), bar_(kind == ProgressKind::automatic && count > 1 && !quiet && is_terminal()),
      openjd_(kind == ProgressKind::openjd) {}

void Progress::hide() {
    if (shown_)
        write_to_stderr("\r\x1b[K");
    shown_ = false;
}

void Progress::show() {
    if (!bar_ || text_.empty())
        return;
    write_to_stderr("\r\x1b[K" + text_);
    shown_ = true;
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
    text_ = fmt::format("{} of {}  {:.3g} frames/s  {} left", done_, count_, rate,
                        in_minutes(static_cast<double>(count_ - done_) / rate));
    if (openjd_) {
        fmt::print("openjd_progress: {:.1f}\nopenjd_status: {}\n",
                   100 * static_cast<double>(done_) / static_cast<double>(count_), text_);
        flush_output();
    }
    show();
}

// How the program is asked to end. A thread waits for signals and sets a flag, which is tested between two steps of the work.
// All others have them blocked: compilers of OpenCL kernels in this process have handlers of their own, which would delete what
// they compile.

void watch_interrupts(void (*last)()) {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction action {};
        sigaction(signal, nullptr, &action);
        if (action.sa_handler != SIG_IGN) // started with nohup or in the background: stays ignored
            sigaddset(&signals, signal);
    }
    std::signal(SIGXFSZ, SIG_IGN); // a file that would be larger than allowed cannot be written, as on a full disk
    std::signal(SIGPIPE, SIG_IGN); // it would end the program while a file is written
    pthread_sigmask(SIG_BLOCK, &signals, nullptr); // threads that start from now on inherit it
    try {
        std::thread(wait_for, signals, last).detach();
    } catch (const std::system_error&) { // no more threads: signals end the program as ever
        pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    }
}

void catch_interrupts() {
    asks = true;
}

void interrupt(int signal) {
    int none = 0;
    received.compare_exchange_strong(none, signal);
}

bool is_interrupted() {
    return received != 0;
}

void stop_if_interrupted() {
    if (is_interrupted())
        throw Interrupted{received};
}

} // namespace fathom::terminal
