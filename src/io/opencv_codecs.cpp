// OpenCV's codecs, silent.
#include "formats.hpp"

#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

#include <iostream>
#include <mutex>

namespace fathom::io {
namespace {

/// OpenCV reports what it cannot decode to its log and to std::cerr as well as by its result; the result is enough.
class Silence {
public:
    Silence() : lock_(one_at_a_time), level_(cv::utils::logging::getLogLevel()), errors_(std::cerr.rdbuf(nullptr)) {
        cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    }
    Silence(const Silence&) = delete;
    Silence& operator=(const Silence&) = delete;
    ~Silence() {
        std::cerr.rdbuf(errors_);
        cv::utils::logging::setLogLevel(level_);
    }

private:
    static inline std::mutex one_at_a_time;
    std::lock_guard<std::mutex> lock_;
    cv::utils::logging::LogLevel level_;
    std::streambuf* errors_;
};

} // namespace

cv::Mat decode_with_opencv(const std::filesystem::path& file, const Bytes& bytes) {
    cv::Mat image;
    try {
        const Silence silence;
        image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
    } catch (const cv::Exception&) {
        image.release();
    }
    if (image.empty())
        refuse(file, "is damaged or of a kind that OpenCV does not read; write it again");
    return image;
}

cv::Mat swap_red_and_blue(const cv::Mat& image) {
    if (image.channels() < 3)
        return image;
    cv::Mat swapped(image.size(), image.type());
    const int pairs[] = {0, 2, 1, 1, 2, 0, 3, 3};
    cv::mixChannels(&image, 1, &swapped, 1, pairs, static_cast<std::size_t>(image.channels()));
    return swapped;
}

} // namespace fathom::io
