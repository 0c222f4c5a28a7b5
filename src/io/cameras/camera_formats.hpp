#pragma once

#include "camera_file/imported.hpp"

#include <filesystem>

/// The formats of cameras that need more than JSON; `import_camera` chooses among them.
namespace fathom::io {

/// The camera in the header of an OpenEXR file. Refuses one without.
Imported import_exr(const std::filesystem::path& file);

/// Says the header of this file, which may be of any type, where its camera is?
bool exr_has_camera(const std::filesystem::path& file);

/// Refuses an option that chooses among cameras, where the file has one.
void refuse_choice(const std::filesystem::path& file, const std::string& chosen, const char* option,
                   const char* formats);
inline constexpr const char* formats_of_images = "COLMAP, KITTI, transforms.json and BOP";

/// OpenCV's calibration or CameraInfo of ROS, in YAML.
Imported import_calibration(const std::filesystem::path& file, const ImportOptions& options);

/// COLMAP's cameras.bin or cameras.txt, or the folder that they lie in.
Imported import_colmap(const std::filesystem::path& file, const ImportOptions& options);

bool is_colmap(const std::filesystem::path& file);

/// The files of a reconstruction that hold its cameras: one of cameras and, where it is there, one of images.
std::vector<std::filesystem::path> colmap_files(const std::filesystem::path& file);

} // namespace fathom::io
