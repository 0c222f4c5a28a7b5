#pragma once

#include <opencv2/core.hpp>

#include <cstring>

/// OpenCV's matrices, compared and taken apart.
namespace fathom::test {

/// Bit for bit.
inline bool same(const cv::Mat& a, const cv::Mat& b) {
    if (a.size() != b.size() || a.type() != b.type())
        return false;
    for (int y = 0; y < a.rows; ++y)
        if (std::memcmp(a.ptr(y), b.ptr(y), static_cast<std::size_t>(a.cols) * a.elemSize()) != 0)
            return false;
    return true;
}

/// One channel of several.
inline cv::Mat plane(const cv::Mat& image, int number) {
    cv::Mat one;
    cv::extractChannel(image, one, number);
    return one;
}

} // namespace fathom::test
