#pragma once

#include <fathom/exr.hpp>

#include <opencv2/core/mat.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// Pictures in files, as light: target `fathom::fathom_io`.
/// Everything here throws `fathom::Error` with one line that names the file, the value and what would be right.
namespace fathom {
#pragma GCC visibility push(default)

/// How the numbers of a picture count light: in proportion to it, or as IEC 61966-2-1 (sRGB) spreads it for eyes.
enum class ColorEncoding { linear, srgb };

const char* to_string(ColorEncoding encoding);

/// How a file holds a picture, apart from its pixels.
struct PictureFormat {
    ColorEncoding encoding = ColorEncoding::linear;
    int bits = 32;                        ///< of a channel: 8 and 16 are integers from 0 to 1, 32 floats
    std::vector<unsigned char> icc = {};  ///< the colour profile as the file has it; empty without one
    std::vector<unsigned char> exif = {}; ///< the camera's data, of a picture that stands upright; empty without
    bool incomplete =
        false; ///< the file has more that is not kept: the Exif data of a TIFF, the profile of a grey picture
    std::string primaries =
        {}; ///< what an OpenEXR file says of its light, if these are not sRGB's: "ACEScg"; not converted
};

/// A picture as light.
struct Picture {
    cv::Mat color; ///< CV_32FC3 or CV_32FC4 in OpenCV's order B, G, R; linear, with its alpha multiplied in
    PictureFormat format = {};
};

struct ReadPictureOptions {
    std::string layer = {};                     ///< of an OpenEXR file, see `read_color`
    std::optional<ColorEncoding> encoding = {}; ///< of the file; default: what its type says
    std::optional<Windows> windows = {};        ///< of a depth image, whose pixels the picture is to have
};

/// Reads a picture and makes light of it.
///
/// JPEG, PNG and TIFF of integers are sRGB, unless the file says linear: a gAMA chunk of 1, or a colour profile with straight
/// curves. OpenEXR, Radiance HDR, PFM and TIFF of floats are linear. A profile's primaries are kept, not converted. An alpha is
/// straight in PNG, multiplied in in OpenEXR, and as ExtraSamples says in TIFF (default: straight in integers). A picture that
/// Exif turns is turned upright.
/// Throws: Error as `read_color`, and for a JPEG that is cut short.
/// Source: IEC 61966-2-1; PNG, third edition, 11.3.2; ICC.1:2022, 10.6 and 10.18; Exif 2.32, tag 274.
Picture read_picture(const std::filesystem::path& file, const ReadPictureOptions& options = {});

/// `restore_highlights` of photograph.hpp for a picture of integers. One of floats stays as it is. Throws as that.
void restore_highlights(Picture& picture, double highlights);

/// How a picture of this format is written into a file of this type: .jpg is sRGB of 8 bits, .exr, .hdr and .pfm are linear
/// floats, .png and .tif keep the format; floats become 16 bits, linear, in a .png.
PictureFormat format_for(const std::filesystem::path& file, const PictureFormat& format);

/// Does `format_for` lose the profile or the camera's data? Only .jpg and .png hold both; .tif holds a profile.
bool loses_metadata(const std::filesystem::path& file, const PictureFormat& format);

/// Writes a picture as `format_for` says, as `write_image` does otherwise. Integers end at 0 and 1; NaN becomes 0.
/// A JPEG has quality 95 and no alpha: one that is not 1 everywhere is refused.
void write_picture(const std::filesystem::path& file, const Picture& picture);

#pragma GCC visibility pop
} // namespace fathom
