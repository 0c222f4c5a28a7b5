#pragma once

#include <fathom/picture.hpp>

namespace fathom::io {

/// Light from the numbers of a file, and back. The fourth channel, an alpha, is left alone.
void to_linear(cv::Mat& color, ColorEncoding encoding);
void from_linear(cv::Mat& color, ColorEncoding encoding);

/// Multiplies the alpha into the colours, or takes it out again; colours under an alpha of 0 become 0.
void premultiply(cv::Mat& color);
void unpremultiply(cv::Mat& color);

} // namespace fathom::io
