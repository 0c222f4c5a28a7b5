#pragma once

#include "formats.hpp"

#include <span>

namespace fathom::io {

/// Pixels without a header, by ffmpeg's name: rows from above, without gaps, R before G before B, the lowest byte first.
struct RawFormat {
    const char* name;
    int channels, bits; ///< 8 and 16 bits are codes, 32 floats
};

inline constexpr RawFormat raw_formats[] = {
    {"gray16le", 1, 16}, {"grayf32le", 1, 32}, {"rgb24", 3, 8}, {"rgbf32le", 3, 32}};

/// The pixels of an image. Codes of a picture are sRGB, unless the picture's own codes are not; those of other images are as in a
/// .png.
/// Throws: Error for an image that the format does not hold, as an alpha that is not 1.
Bytes raw_bytes(const ImageFile& image, const RawFormat& format);

} // namespace fathom::io
