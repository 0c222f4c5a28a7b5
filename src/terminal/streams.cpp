// The program's streams.
#include "streams.hpp"

#include <opencv2/core/utils/logger.hpp>

#include <cerrno>

#include <fcntl.h>
#include <unistd.h>

namespace fathom::cli {

void prepare_streams() {
    // Each the other way round, so that what is read from it or printed there fails, as through a closed one.
    for (const int file : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(file, F_GETFD) < 0)
            open("/dev/null", file == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
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

} // namespace fathom::cli
