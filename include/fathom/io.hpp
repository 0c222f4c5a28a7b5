#pragma once

#include <fathom/camera.hpp>

#include <opencv2/core/mat.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// Files: depth images in, results out, and the camera file. The only part that knows OpenCV's codecs and OpenEXR.
/// Everything here throws `fathom::Error` with one line that names the file, the value and what would be right.
namespace fathom {

/// A depth image as its file holds it: values untouched, one channel (or three bytes for packed depth).
struct DepthFile {
    cv::Mat values;  ///< CV_32FC1, CV_16FC1 (half), CV_16UC1, CV_32SC1 (uint24 in a uint32) or CV_8UC3 (R, G, B order)
    Storage storage; ///< how `values` is to be read
    std::string channel; ///< name of the EXR channel that was taken; empty for other files
};

struct ReadOptions {
    std::string channel;            ///< EXR channel to take; empty: Z, *.Depth.Z, V, depth.V, Y, or the only one
    std::optional<Storage> packing; ///< uint24, uint24_high, rgb8_*: what the camera file's `packing` says
};

/// Reads a depth image: `.exr` with OpenEXR (any part, half, float or uint; the display window, NaN where the data
/// window does not reach), everything else with OpenCV, unchanged.
/// Throws: Error for a file that is missing, empty, a directory, damaged, deep, 8-bit or colour without a packing.
DepthFile read_depth(const std::filesystem::path& file, const ReadOptions& options = {});

/// A channel of an OpenEXR file.
struct Channel {
    std::string
        name; ///< as `ReadOptions::channel` takes it: with its part's name in front when there are several parts
    std::string type; ///< "half", "float" or "uint"; "deep …" in a deep part
};

/// All channels of an OpenEXR file; none for any other file.
/// Throws: Error for a file that cannot be read or whose header is damaged.
std::vector<Channel> list_channels(const std::filesystem::path& file);

/// Writes a float image, temporary file first and then renamed, so that no half-written file is ever seen.
/// `.exr` with the given channel names (32-bit float), `.tif`, `.pfm` (1 or 3 channels), `.png` (16-bit, values × 65535 × `png_scale`,
/// refused without a scale), `.ply` for three channels (points that are not finite are left out).
struct WriteOptions {
    std::vector<std::string> channels; ///< EXR channel names, one a channel, in the image's order
    std::optional<double> png_scale;   ///< .png: stored = round(value × scale × 65535); without it .png is refused
};
void write_image(const std::filesystem::path& file, const cv::Mat& image, const WriteOptions& options = {});

/// Defaults for lens options that a renderer wrote into the camera file.
struct LensDefaults {
    std::optional<double> lens_mm, sensor_mm, f_stop, focus_distance, ao_distance;
};

/// A camera file (JSON, docs/camera.md): the camera, how its depth is packed, and what else the renderer knew.
struct CameraFile {
    Camera camera; ///< width and height are 0 when the file does not give them
    std::optional<Storage> packing;
    LensDefaults lens;
};

/// Reads a camera file. Unknown keys are refused with the nearest known one; every refusal names the key and its value.
CameraFile read_camera(const std::filesystem::path& file);

/// The camera for an image of this size: takes the size if the file gave none, otherwise checks it.
/// Throws: Error naming both sizes.
Camera camera_for(const CameraFile& file, int width, int height);

} // namespace fathom
