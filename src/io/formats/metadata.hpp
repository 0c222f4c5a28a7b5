#pragma once

#include "camera_file/file.hpp"

#include <cstdint>
#include <optional>
#include <span>

/// What a picture's file says beside its pixels.
namespace fathom::io {

using View = std::span<const unsigned char>;

/// The number in the first four bytes, the highest first.
inline std::uint32_t big_endian(View b) {
    return std::uint32_t{b[0]} << 24 | std::uint32_t{b[1]} << 16 | std::uint32_t{b[2]} << 8 | b[3];
}

/// Does a colour profile count light in proportion? All three curves are straight.
bool is_linear_profile(View icc);

/// Is a colour profile one of R, G and B?
bool is_rgb_profile(View icc);

/// Bytes of Exif that fit into the one segment of a JPEG that holds it. A PNG may have more.
inline constexpr std::size_t most_exif_of_jpeg = 65527;

/// Where the first row and column lie, 1 to 8 as Exif and TIFF have it; 1 where the data does not say.
int orientation_of(View exif);

/// Says that the picture stands upright.
void set_upright(Bytes& exif);

} // namespace fathom::io
