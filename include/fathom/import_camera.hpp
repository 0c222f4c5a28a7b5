#pragma once

#include <fathom/camera_file.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// Cameras from files that other programs wrote (docs/cameras.md). `import_json_camera` is a part of
/// `fathom::camera_file`, `import_camera` of `fathom::fathom_io`.
namespace fathom {
#pragma GCC visibility push(default)

/// Which camera of a file is meant, and what the file does not say.
struct ImportOptions {
    std::string image = {}; ///< COLMAP, transforms.json: the image whose camera it is; not needed where there is one
    std::string node = {};  ///< glTF: name or index of the node; not needed where one node has a camera
    /// What the values of the depth mean: NAME, NAME:key=value,... or key=value,..., as `preset_camera` takes it,
    /// without what the file knows. These keys come before those of the file.
    std::string preset = {};
    /// The image has no distortion any more. ROS: it was rectified, so its projection is P. OpenCV: it was remapped
    /// with the camera matrix itself as the new one. Warnings tell where the depth is distorted still.
    bool undistorted = false;
    std::optional<Storage> storage = {}; ///< of the depth; ROS counts integers in millimetres and floats in metres
    std::filesystem::path depth = {};    ///< the depth's name chooses among images if `image` does not
};

/// A camera that a file stands for.
struct ImportedCamera : CameraFile {
    std::string text; ///< the camera file (JSON) that says the same: `read_camera` makes the same camera of it
    std::vector<std::string> warnings; ///< one line each, without the file's name
};

/// Reads a camera file (JSON), glTF 2.0 (.gltf, .glb) or transforms.json of nerfstudio and instant-ngp; the content
/// decides. World positions are those of the file. Lengths are in the file's unit, angles and pixels as the camera
/// file has them.
/// Throws: Error, one line with the file's name, for what is damaged or missing, several cameras without a choice
/// among them, distortion, and depth whose values nobody describes.
/// Source: glTF 2.0, 3.10; nerfstudio's data conventions; instant-ngp's nerf_loader.cu.
ImportedCamera import_json_camera(const std::filesystem::path& file, const ImportOptions& options = {});

/// The same, and: the header of an OpenEXR image, OpenCV's calibration (YAML, as cv::FileStorage writes it),
/// CameraInfo of ROS (YAML, as its drivers keep it or as the message is printed), COLMAP (a folder, cameras.bin or
/// cameras.txt).
/// Throws: Error as above, and for an image without a camera.
/// Source: OpenEXR's standard attributes; REP 104 and 118, sensor_msgs/CameraInfo; COLMAP's output format.
ImportedCamera import_camera(const std::filesystem::path& file, const ImportOptions& options = {});

#pragma GCC visibility pop
} // namespace fathom
