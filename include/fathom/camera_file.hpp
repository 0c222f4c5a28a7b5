#pragma once

#include <fathom/camera.hpp>

#include <filesystem>
#include <optional>

/// The camera file, JSON: target `fathom::camera_file`, which needs neither OpenCV nor OpenEXR.
/// Everything here throws `fathom::Error` with one line that names the file, the key, its value and what would be right.
namespace fathom {

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
