// The program's streams.
#include "streams.hpp"

#include <opencv2/core/utils/logger.hpp>

#include <cerrno>

#include <fcntl.h>
#include <unistd.h>

namespace fathom::cli {

void prepare_streams() {
    int file;
    while ((file = open("/dev/null", O_RDWR)) >= 0 && file <= STDERR_FILENO) {
    }
    close(file);
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
