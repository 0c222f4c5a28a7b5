// Is packed depth a picture? Where the highest byte of a surface's depth grows by 1, the byte below it falls by nearly 256.
// In a picture both grow alike.
#include "photograph.hpp"

#include <opencv2/core.hpp>

#include <cstdlib>

namespace fathom::cli {

std::optional<std::string> photograph_doubt(const Subject& subject) {
    if (subject.stored.storage != Storage::bgr8_red_low && subject.stored.storage != Storage::bgr8_red_high)
        return std::nullopt;
    const int high = subject.stored.storage == Storage::bgr8_red_low ? 0 : 2;
    std::size_t steps = 0, alike = 0, carried = 0;
    subject.each([&](const cv::Mat& values, const cv::Mat&) {
        for (int y = 0; y < values.rows; ++y) {
            const auto* row = values.ptr<cv::Vec3b>(y);
            for (int x = 1; x < values.cols; ++x) {
                const int step = row[x][high] - row[x - 1][high], below = row[x][1] - row[x - 1][1];
                steps += std::abs(step) == 1;
                alike += std::abs(step) == 1 && std::abs(below) <= 16;
                carried += std::abs(step) == 1 && std::abs(256 * step + below) < 96;
            }
        }
    });
    if (steps <= 64 || 5 * alike < 3 * steps || 33 * carried >= steps)
        return std::nullopt;
    return "its bytes change like the colours of a picture, and not like packed depth; is it the right file? Depth "
           "that "
           "a renderer shows in colours cannot be decoded: save raw depth";
}

} // namespace fathom::cli
