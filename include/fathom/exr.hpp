#pragma once

#include <opencv2/core/types.hpp>

#include <filesystem>
#include <string>

/// What OpenEXR files have beside their pixels.
namespace fathom {
#pragma GCC visibility push(default)

/// Where an image's pixels lie. OpenEXR has two windows: a camera sees the display window, and the data window has pixels,
/// which may be fewer (a crop) or more (overscan).
struct Windows {
    cv::Rect data; ///< the image's pixels, counted from the first pixel of the display window; x and y may be negative
    cv::Size display; ///< the size of the display window

    bool operator==(const Windows&) const = default;
};

/// How OpenEXR packs pixels. All keep every bit, but for `dwaa`: it changes channels called R, G, B or Y a little, those of
/// normals (N.Y) and positions (P.Y), too.
enum class ExrCompression { none, zips, zip, piz, dwaa };

/// The OpenEXR file that a result belongs to.
struct ExrSource {
    std::filesystem::path file;
    std::string channel;     ///< as in `ReadOptions`: the part that has it is meant
    Windows windows;         ///< of the result, whose data window has its size
    bool append = false;     ///< does the result also hold all that the file holds?
    bool is_resized = false; ///< has the result other pixels, so that its display window is that of `windows`?
};

/// How many threads OpenEXR takes to read and to write, in the whole process: as many as there are cores, if 0. Without this call
/// OpenEXR takes those that Imf::setGlobalThreadCount was told, at first none.
void set_exr_threads(int threads);

#pragma GCC visibility pop
} // namespace fathom
