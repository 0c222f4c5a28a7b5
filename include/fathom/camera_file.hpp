#pragma once

#include <fathom/camera.hpp>
#include <fathom/lens.hpp>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

/// The camera file, JSON: target `fathom::camera_file`, which needs neither OpenCV nor OpenEXR.
/// Everything here throws `fathom::Error` with one line that names the file, the key, its value and what would be right.
namespace fathom {
#pragma GCC visibility push(default)

/// The curve of sRGB among exponents.
inline constexpr double gamma_of_srgb = 0;

/// A camera file (JSON, docs/camera.md): the camera, how its depth is packed, and what else the renderer knew.
struct CameraFile {
    Camera camera; ///< width and height are 0 when the file does not give them
    std::optional<Packing> packing;
    std::optional<double> gamma = {}; ///< see `ReadOptions::gamma`
    LensDefaults lens;
    std::string preset; ///< the source that the file names; empty without one

    /// The projection of an image of this size, if the file leaves it to the image: see `camera_for`.
    std::function<Projection(int width, int height)> projection_for = {};
    std::function<LensModel(int width, int height)> lens_for = {}; ///< likewise of a panorama, or a lens in millimetres
};

/// Reads a camera file. Unknown keys are refused with the nearest known one; every refusal names the key and its value.
CameraFile read_camera(const std::filesystem::path& file);

/// The camera of a source of depth, for an image of this size, from a text NAME or NAME:key=value,key=value. Keys are those of
/// the camera file; the ones of its objects `perspective`, `intrinsics` and `orthographic` stand alone:
/// "tum:fx=525,fy=525,cx=319.5,cy=239.5". `presets` lists the names.
Camera preset_camera(const std::string& text, int width, int height);

/// The same as a camera file that says it, for what else there is in it: `read_depth` needs to know how depth is packed.
CameraFile preset_file(const std::string& text);

/// The camera for an image of this size: takes the size if the file gave none, otherwise checks it.
/// Throws: Error naming both sizes.
Camera camera_for(const CameraFile& file, int width, int height);

/// What is probably wrong with the keys of a camera file's text for an image of this size, a sentence each with the cure: radians
/// as degrees, an aspect upside down, a calibration of another size. Of a text that `read_camera` would refuse nothing is said.
/// `depth_doubts` of doubts.hpp looks at the depth.
std::vector<std::string> key_doubts(const std::string& text, int width, int height);

#pragma GCC visibility pop
} // namespace fathom
