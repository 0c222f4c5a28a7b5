// Keeps the image libraries' own messages off the program's streams.
#include "codecs.hpp"

#include <opencv2/core/utils/logger.hpp>

#include <cstdio>

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

StderrSilenced::StderrSilenced() : kept_(fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3)) {
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (kept_ >= 0 && nowhere >= 0)
        dup2(nowhere, STDERR_FILENO);
    close(nowhere);
}

StderrSilenced::~StderrSilenced() {
    std::fflush(stderr);
    if (kept_ < 0)
        return;
    dup2(kept_, STDERR_FILENO);
    close(kept_);
}

} // namespace fathom::cli
