#pragma once

#include <opencv2/core/mat.hpp>

namespace fathom::cli {

/// Stored values without holes: a pixel whose `z` is NaN takes the value of the nearest valid pixel to its left or to its
/// right, the farther one in z. In a row without valid pixels it takes that above or below.
cv::Mat without_holes(const cv::Mat& values, const cv::Mat& z);

} // namespace fathom::cli
