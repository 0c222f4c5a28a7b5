// Keeps the image libraries' own messages off the program's streams.
#include "codecs.hpp"

#include <opencv2/core/utils/logger.hpp>

#include <cerrno>
#include <cstdio>
#include <mutex>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace fathom::cli {
namespace {

std::mutex guard;
int silenced = 0; // by how many
int kept = -1;    // stderr meanwhile

} // namespace

void prepare_streams() {
    int file;
    while ((file = open("/dev/null", O_RDWR)) >= 0 && file <= STDERR_FILENO) {
    }
    close(file);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
}

StderrSilenced::StderrSilenced() {
    const std::lock_guard locked(guard);
    if (silenced++ > 0)
        return;
    kept = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (kept >= 0 && nowhere >= 0)
        dup2(nowhere, STDERR_FILENO);
    close(nowhere);
}

StderrSilenced::~StderrSilenced() {
    const std::lock_guard locked(guard);
    if (--silenced > 0)
        return;
    std::fflush(stderr);
    if (kept < 0)
        return;
    dup2(kept, STDERR_FILENO);
    close(std::exchange(kept, -1));
}

void write_to_stderr(std::string_view text) {
    const std::lock_guard locked(guard);
    const int file = kept >= 0 ? kept : STDERR_FILENO;
    while (!text.empty()) {
        const auto written = ::write(file, text.data(), text.size());
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return;
        text.remove_prefix(static_cast<std::size_t>(written));
    }
}

} // namespace fathom::cli
