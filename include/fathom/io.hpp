#pragma once

#include <fathom/camera_file.hpp>
#include <fathom/exr.hpp>
#include <fathom/picture.hpp>

#include <opencv2/core/mat.hpp>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// Files: depth images in, results out. The only part that knows OpenCV's codecs, OpenEXR and libtiff.
/// Everything here throws `fathom::Error` with one line that names the file, the value and what would be right.
namespace fathom {
#pragma GCC visibility push(default)

/// A depth image as its file holds it: values untouched, one channel (or three bytes for packed depth).
struct DepthFile {
    /// CV_32FC1, CV_16FC1 (half), CV_8UC1, CV_16UC1, CV_32SC1 (uint24 in a uint32) or CV_8UC3 (B, G, R)
    cv::Mat values;
    Storage storage;      ///< how `values` is to be read
    std::string channel;  ///< name of the EXR channel that was taken; empty for other files
    Windows windows = {}; ///< where `values` lie
    int pages = 1;        ///< images of full size in a TIFF, of which the first was taken
    std::array<std::optional<double>, 2> near_and_far = {}; ///< that a PNG's text says
};

struct ReadOptions {
    /// EXR channel to take, or PART.CHANNEL; empty: the one that is named like depth. Of an NPZ the array; empty: the only one.
    std::string channel = {};
    std::optional<Packing> packing = {}; ///< what the camera file's `packing` says
    /// What its `gamma` says: values went through a curve, and this power of them, as parts of the largest, is what they were: 2.2 for
    /// a display's, 0.5 for Blender's quadratic mist, `gamma_of_srgb` for sRGB's. They come back as floats.
    std::optional<double> gamma = {};
    /// Of OpenEXR, read the data window instead of the display window: `cropped` makes its camera.
    bool overscan = false;
    /// PGM: are codes taken that count to another number than 255 or 65535? As lengths (`is_metric`) they mean the same, but they
    /// are other fractions of a range. Bytes of red that are all full are no lengths, and are refused as a picture's then.
    bool as_counted = false;
    std::size_t memory = 0; ///< bytes that an array of an NPZ may take; 0: what the machine or its control group has
};

/// Reads a depth image. The content decides what it is, not the extension.
///
/// OpenEXR: any part, scan lines or tiles, half, float or uint; the display window, NaN where the data window does not
/// reach, or the data window. Without a name the first of these channels is taken, in all parts: Z, *.Depth.Z, V, *.Depth.V,
/// *.Depth, *.ZDepth, *.Z, Y, or the only one there is; X, Y and Z side by side are a position. PNG: 16-bit grey. TIFF: one
/// channel of 16-bit or 32-bit integers, half or float. PFM: grey, values as they are whatever its scale. PGM: 16-bit. 8-bit
/// grey, R, G, B (and an alpha that is left out) and R, G, B, A with the packing that says so: R, G, B come back in B, G, R
/// order, with the bgr8_ storage of that packing, and R, G, B, A and base 255 as floats from 0 to 1. NPY (NumPy): rows and columns of floats
/// or integers, of any byte order; what has 64 bits is rounded to 32. NPZ: an array of these. COLMAP's depth maps. R = G = B of
/// 16 bits or floats count as one channel. Codes of more than 24 bits are refused, unless they are
/// said to lie in the high bits.
/// Throws: Error for a file that is missing, empty, a folder, damaged, cut short, incomplete, deep, or of any other type.
DepthFile read_depth(const std::filesystem::path& file, const ReadOptions& options = {});

/// Relative depth as its file holds it (see relative.hpp).
struct RelativeFile {
    cv::Mat values; ///< CV_32FC1, 0 to 1; NaN where the file has it
    int bits = 32;  ///< of the file: 8 and 16 are integers, 32 floats
};

struct ReadRelativeOptions {
    std::string channel = {}; ///< as in ReadOptions
    /// Stored values that become 0 and 1. Default: the least and the greatest of floats, all codes of integers.
    std::optional<std::array<double, 2>> range = {};
};

/// Reads relative depth: PNG, JPEG and TIFF of 8 and 16 bits; TIFF, PFM and OpenEXR of floats. It has one channel, or R = G = B;
/// of OpenEXR a channel is taken.
/// Throws: Error as `read_depth`, for depth painted with a colour map, for pixels of which none has a value, and for a range that
/// is not finite or does not ascend.
RelativeFile read_relative(const std::filesystem::path& file, const ReadRelativeOptions& options = {});

/// `upsample_along_edges` of photograph.hpp for CV_32FC1, and CV_32FC3 or 4 in linear light. Out: CV_32FC1 of the picture's size.
/// Throws: Error for other types.
cv::Mat upsample_along_edges(const cv::Mat& depth, const cv::Mat& color);

/// Reads normals: CV_32FC3, x, y, z as the file holds them, (0, 0, 0) where there is none. What axes they are in the file does
/// not say.
///
/// OpenEXR: a layer with channels X, Y, Z (or R, G, B), the one called `layer`, for instance "ViewLayer.Normal"; without a
/// name the first of N, Normal, Normals, alone or at the end of a name, or the only three channels there are. TIFF and PFM:
/// three channels of float. PNG: three channels of 8 or 16 bits that hold ½n + ½, black where there is none. An alpha is
/// left out. Lengths stay: one unlike 1 is a renderer's mean over an edge, which `ssao` counts as none. NaN and lengths below
/// 0.001 are no normal.
/// With `windows`, those of a depth image, the result has that image's pixels, without a normal where the file has none.
/// Throws: Error as `read_depth`, for a file without such a layer, with other channels, or of another display window, and for
/// vectors of which more than a quarter have lengths that differ from 1 by 0.2: pictures and positions.
cv::Mat read_normals(const std::filesystem::path& file, const std::string& layer = {},
                     const std::optional<Windows>& windows = {});

/// Reads a picture: CV_32FC3 or CV_32FC4 in OpenCV's order B, G, R, and the alpha where the file has one. Values are as they
/// are; codes of 8 and 16 bits count from 0 to 1.
///
/// OpenEXR: the layer called `layer`, for instance "ViewLayer.Combined", whose channels are R, G, B and perhaps A; without a
/// name those without a layer, or Combined, beauty, RGBA, RGB, color, alone or at the end of a name, or the only one there
/// is. PNG, TIFF and PFM: three or four channels. JPEG and Radiance HDR. `read_picture` makes light of the values.
/// Throws: Error as `read_depth`, and for a file without such a layer or with other channels.
cv::Mat read_color(const std::filesystem::path& file, const std::string& layer = {});

/// Names of the channels of the layer that `read_color` takes from an OpenEXR file: R, G, B and perhaps A.
std::vector<std::string> color_channels(const std::filesystem::path& file, const std::string& layer = {});

/// A channel of an OpenEXR file.
struct Channel {
    std::string name; ///< as `ReadOptions::channel` takes it: its part's name in front when there are several parts
    std::string type; ///< "half", "float" or "uint"; "deep ..." in a deep part
};

/// All channels of an OpenEXR file, read from its header alone; none for any other file.
/// Throws: Error for a file that cannot be read or whose header is damaged.
std::vector<Channel> list_channels(const std::filesystem::path& file);

struct WriteOptions {
    /// EXR channel names, in the image's order. More names than channels name these again, from the first on. Default for a single
    /// channel: Z, and Y, which other programs open.
    std::vector<std::string> channels = {};
    std::optional<double> png_scale = {}; ///< .png: round((value × scale + offset) × 65535); without it .png is refused
    double png_offset = 0;
    /// .exr: whose header is kept: all attributes but those of the old pixels (preview, tiles, chunkCount), the display window, the
    /// part's name.
    std::optional<ExrSource> source = {};
    bool half = false; ///< .exr: floats of 16 bits; numbers beyond 65504 are refused
    /// .exr. Default: that of the file to append to if it keeps every bit, otherwise zip.
    std::optional<ExrCompression> compression = {};
    cv::Mat normals = {},
            colors = {}; ///< .ply: of the points; CV_32FC3 x, y, z; and B, G, R in linear light, perhaps an alpha
};

/// Writes a CV_32F image of any number of channels, temporary file first and then renamed, so that no half-written file is
/// ever seen and a failure leaves the old one. Channels keep their order: x, y, z of vectors. For pictures see `write_color`.
///
/// `.exr` (32-bit float or half), `.tif` (float; 1, 3 or 4 channels), `.pfm` (1 or 3), `.npy` (float32 in rows), `.png` (16-bit;
/// 1, 3 or 4; clipped to its range, NaN becomes 0), `.ply` for 3 or 4 (binary; the first three are the point, points that are
/// not finite are left out; colours are sRGB of 8 bits).
///
/// A result may be appended to its source: a copy of the file with channels more. They join the only part of a file that keeps
/// every bit (and is neither deep nor tiled), and are a part of their own beside unchanged copies of all parts otherwise.
/// Throws: Error for another extension, a target that cannot be written, a full disk.
void write_image(const std::filesystem::path& file, const cv::Mat& image, const WriteOptions& options = {});

/// Writes a picture, CV_32FC3 or CV_32FC4 in OpenCV's order B, G, R and alpha, otherwise as `write_image` does. Files hold
/// R, G, B, A, so that viewers show its colours. `WriteOptions::channels` are in the file's order; without them R, G, B, A.
/// Throws: Error as `write_image`, and for other numbers of channels.
void write_color(const std::filesystem::path& file, const cv::Mat& color, const WriteOptions& options = {});

/// What an image's channels are, which decides their order in a file.
enum class ImageKind { values, color };

/// An image and the file that it belongs in.
struct ImageFile {
    std::filesystem::path file;
    cv::Mat image;
    WriteOptions options = {};
    ImageKind kind = ImageKind::values;
    std::optional<PictureFormat> format = {}; ///< of a picture that is light: see `write_picture`
};

/// Writes images that belong together, each as `write_image`, `write_color` or `write_picture` does: when one of them cannot be written,
/// none is.
void write_images(const std::vector<ImageFile>& images);

#pragma GCC visibility pop
} // namespace fathom
