#pragma once

#include <opencv2/core/mat.hpp>

#include <string_view>

namespace fathom::cli {

inline constexpr int letter_width = 8, letter_height = 13; ///< in pixels, at a scale of 1

/// The number of letters of a UTF-8 text.
int letters(std::string_view text);

/// Writes a line of UTF-8 text into a CV_8UC3 image, its upper left corner at `at`; each of its pixels becomes scale × scale.
/// It has ASCII and ½; any other letter is a question mark. What lies outside of the image is left out.
void draw_text(cv::Mat& image, cv::Point at, std::string_view text, const cv::Vec3b& color, int scale);

} // namespace fathom::cli
