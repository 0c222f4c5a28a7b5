#pragma once

#include "camera_file/file.hpp"
#include "io/formats.hpp"

#include <opencv2/core.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// What stands before OpenCV's codecs: they fill what a file lacks with anything, so each format's bytes are checked first. And
/// what a picture's file says beside its pixels.
namespace fathom::io {

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

/// A file in memory that has a name for libraries.
class MemoryFile {
public:
    /// `file` stands in the message of a failure.
    MemoryFile(const std::filesystem::path& file, View bytes);
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile();

    std::string name() const;

private:
    int descriptor_;
};

/// While one lives, nothing that its thread prints to stderr appears, and errors of libtiff are kept.
class Quiet {
public:
    Quiet();
    Quiet(const Quiet&) = delete;
    Quiet& operator=(const Quiet&) = delete;
    ~Quiet();

    /// The first error of libtiff in this thread: OpenCV forgives some.
    static std::string& tiff_error();
};

/// A function of OpenCV's codecs or of a library behind them. Throws: Error where there is none.
void* codec_function(const char* name);

/// The pixels of a file that has been checked; it is refused where OpenCV reads none or another size.
cv::Mat decoded(const std::filesystem::path& file, const MemoryFile& memory, cv::Size size);

/// Likewise of a file's bytes, which are taken.
cv::Mat decoded(const std::filesystem::path& file, Bytes& bytes, cv::Size size);

/// The bytes of an image in B, G, R order, by the extension of the format and its parameters, as `cv::imencode` has them.
Bytes encoded(const std::string& extension, const cv::Mat& bgr, const std::vector<int>& parameters = {});

/// Of the formats that OpenCV reads.
PictureFile read_png(const std::filesystem::path& file, Bytes& bytes);
PictureFile read_jpeg(const std::filesystem::path& file, Bytes& bytes);
PictureFile read_tiff(const std::filesystem::path& file, Bytes& bytes);
PictureFile read_radiance(const std::filesystem::path& file, Bytes& bytes);

} // namespace fathom::io
