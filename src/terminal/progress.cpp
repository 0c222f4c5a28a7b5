// The bar is the last line of the terminal. Whatever else is printed takes its place first.
#include "progress.hpp"

#include "messages.hpp"
#include "streams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <sys/ioctl.h>
#include <unistd.h>

namespace fathom::cli {
namespace {

bool is_terminal() {
    const char* kind = std::getenv("TERM");
    return isatty(STDERR_FILENO) && kind && std::string_view(kind) != "dumb";
}

std::size_t columns() {
    winsize size{};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

} // namespace

std::string in_minutes(double seconds) {
    const auto whole = std::llround(std::min(seconds, 1e9));
    const auto hours = whole / 3600, minutes = whole / 60 % 60;
    return hours > 0 ? fmt::format("{}:{:02}:{:02}", hours, minutes, whole % 60)
                     : fmt::format("{}:{:02}", minutes, whole % 60);
}

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
    const std::size_t place = columns(), around = text.size() + 5;
    std::string bar;
    if (place > around + 10) {
        const std::size_t length = std::min<std::size_t>(place - around, 40), full = length * done_ / count_;
        bar = "[" + std::string(full, '#') + std::string(length - full, '.') + "]  ";
    }
    write_to_stderr("\r\x1b[K" + (bar + text).substr(0, place - 1));
    shown_ = true;
}

} // namespace fathom::cli
