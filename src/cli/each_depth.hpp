#pragma once

#include "options.hpp"

#include <fathom/image.hpp>

#include <opencv2/core/mat.hpp>

#include <functional>
#include <string>
#include <vector>

namespace fathom::cli {

/// What an operation makes of a depth image.
struct Product {
    std::vector<std::string> endings;  ///< types it can be written as, the default first
    std::vector<std::string> channels; ///< EXR names of its channels
};

/// Reads each input, runs the operation, writes the result and says so; a bad input is reported and the others are
/// still done. Gives the exit code.
/// Throws: UsageError, NoDevice and Interrupted, and Error for the camera file.
int each_depth(const DepthOptions& options, const Product& product,
               const std::function<cv::Mat(const StoredDepth&)>& operation);

} // namespace fathom::cli
