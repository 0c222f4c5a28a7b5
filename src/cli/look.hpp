#pragma once

#include <fathom/findings.hpp>
#include <fathom/image.hpp>
#include <fathom/io.hpp>

#include <opencv2/core/mat.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace fathom::cli {

/// What a depth image is once it is decoded. Depths are in scene units along the view axis.
struct Look {
    std::size_t pixels = 0, invalid = 0, background = 0;
    float nearest = 0, farthest = 0; ///< of the surfaces; 0 where no pixel shows one
    cv::Mat z;                       ///< CV_32FC1: +infinity is background, NaN invalid

    std::size_t surfaces() const { return pixels - invalid - background; }
};

/// The image in host memory.
HostDepth on_host(const DepthFile& depth);

/// Decodes the image and counts. `depth` is what `stored.image` was made of.
Look look_at(const StoredDepth& stored);

/// What is probably wrong with the description of an image, a sentence each with the cure.
/// Throws: Error where no pixel has a depth, which says why that is likely.
std::vector<std::string> doubts(const DepthFile& depth, const StoredDepth& stored, const Look& look);

/// "z 0.5 to 12, 3 % background, 96 of 9600 pixels invalid (1 %)": for the line about a result.
std::string in_words(const Look& look);

/// The end of it.
std::string invalid_in_words(std::size_t invalid, std::size_t pixels);

} // namespace fathom::cli
