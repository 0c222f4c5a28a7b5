// Holes in depth lie mostly beside an edge, where a sensor's light or the second camera did not reach: behind it.
#include "fill.hpp"

#include <cmath>
#include <cstring>
#include <vector>

namespace fathom::cli {
namespace {

constexpr int none = -1;

// The place of the nearest valid pixel before and behind each of a line, the farther of the two; none if there is none.
void farther_sides(int count, const auto& z_at, const auto& take) {
    std::vector<int> before(static_cast<std::size_t>(count));
    for (int i = 0, last = none; i < count; ++i) {
        last = std::isnan(z_at(i)) ? last : i;
        before[static_cast<std::size_t>(i)] = last;
    }
    for (int i = count - 1, behind = none; i >= 0; --i) {
        behind = std::isnan(z_at(i)) ? behind : i;
        const int other = before[static_cast<std::size_t>(i)];
        const bool take_other = other != none && (behind == none || z_at(other) >= z_at(behind));
        take(i, take_other ? other : behind);
    }
}

} // namespace

cv::Mat without_holes(const cv::Mat& values, const cv::Mat& z) {
    cv::Mat filled = values.clone(), depth = z.clone();
    const auto copy = [&](cv::Point to, cv::Point from) {
        std::memcpy(filled.ptr(to.y, to.x), values.ptr(from.y, from.x), values.elemSize());
    };
    for (int y = 0; y < z.rows; ++y)
        farther_sides(
            z.cols, [&](int x) { return z.at<float>(y, x); },
            [&](int x, int from) {
                if (from == none)
                    return;
                copy({x, y}, {from, y});
                depth.at<float>(y, x) = z.at<float>(y, from);
            });
    for (int x = 0; x < z.cols; ++x)
        farther_sides(
            z.rows, [&](int y) { return depth.at<float>(y, x); },
            [&](int y, int from) {
                if (from != none && from != y)
                    std::memcpy(filled.ptr(y, x), filled.ptr(from, x), values.elemSize());
            });
    return filled;
}

} // namespace fathom::cli
