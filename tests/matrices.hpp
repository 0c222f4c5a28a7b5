#pragma once

#include <opencv2/core.hpp>

#include <cstring>
#include <vector>

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

/// Several matrices as the channels of one.
inline cv::Mat merged(const std::vector<cv::Mat>& channels) {
    cv::Mat image;
    cv::merge(channels, image);
    return image;
}

/// With another type of numbers, times a scale.
inline cv::Mat converted(const cv::Mat& image, int type, double scale = 1) {
    cv::Mat result;
    image.convertTo(result, type, scale);
    return result;
}

/// Of what `value` gives for each column and row.
template <typename Element = float>
cv::Mat filled(int columns, int rows, const auto& value) {
    cv::Mat_<Element> image(rows, columns);
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
            image(y, x) = static_cast<Element>(value(x, y));
    return image;
}

} // namespace fathom::test
