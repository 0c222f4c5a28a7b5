#pragma once

#include "doubts/look.hpp"

#include <fathom/io.hpp>

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace fathom::io {

/// Relative depth as its file stores it.
struct RelativeInput {
    RelativeFile depth;
    std::string channel = {}; ///< of an OpenEXR file
    Look look = {};           ///< the least value as the nearest
};

/// Which pixels of an image of this size do not count, as CV_8UC1: those that are not 0.
using Ignored = std::function<cv::Mat(cv::Size)>;

/// Reads relative depth as `read_relative`, whose values are not yet 0 to 1. Pixels that do not count become NaN.
RelativeInput read_relative_input(const std::filesystem::path& file, const std::string& channel,
                                  const Ignored& ignored = {});

/// The least and the greatest of a file's floats that count, infinity and -infinity where none does; nothing for integers.
std::optional<std::array<double, 2>> range_of_floats(const std::filesystem::path& file, const std::string& channel,
                                                     const Ignored& ignored = {});

/// Distances along the axis on the grid of a picture, as CV_32FC1: +infinity is the background.
cv::Mat distances_along_edges(const cv::Mat& z, const cv::Mat& color, bool perspective);

} // namespace fathom::io
