#pragma once

#include <fathom/import_camera.hpp>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// What the importers share: each of them makes keys of the camera file, and the reader of that file does the rest.
namespace fathom::io {

/// What an importer found.
struct Imported {
    nlohmann::json keys;           ///< of the camera file
    nlohmann::json otherwise = {}; ///< keys about the values, if neither the file nor the user has an encoding
    bool has_aspect = false;       ///< the image must have the aspect of the keys
    std::string cure = {};         ///< where `otherwise` is empty: what says the encoding
    std::vector<std::string> warnings = {};
    std::vector<std::string> doubts = {}; ///< warnings about `otherwise`
};

/// The keys of the camera file, in the order of its documentation.
const std::vector<std::string>& camera_keys();

/// The camera that a camera file with these keys describes. `file` stands in messages.
CameraFile read_camera_keys(const std::filesystem::path& file, const nlohmann::json& keys);

/// Adds what the user said, and what else follows from the file.
ImportedCamera completed(const std::filesystem::path& file, Imported imported, const ImportOptions& options);

/// A camera file, glTF or transforms.json that was parsed.
Imported import_parsed(const std::filesystem::path& file, nlohmann::json json, const ImportOptions& options);

bool is_gltf(const nlohmann::json& json);
bool is_transforms(const nlohmann::json& json);
bool is_open3d(const nlohmann::json& json);
bool is_bop(const nlohmann::json& json);
bool is_realsense(const nlohmann::json& json);
Imported import_open3d(const std::filesystem::path& file, const nlohmann::json& json, const ImportOptions& options);
Imported import_bop(const std::filesystem::path& file, const nlohmann::json& json, const ImportOptions& options);
Imported import_realsense(const std::filesystem::path& file, const nlohmann::json& json);
Imported import_gltf(const std::filesystem::path& file, const nlohmann::json& gltf, const ImportOptions& options);
Imported import_transforms(const std::filesystem::path& file, nlohmann::json json, const ImportOptions& options);

/// The JSON of a file, or of the first chunk of a binary glTF.
nlohmann::json parsed_json_or_glb(const std::filesystem::path& file);

/// The text under a key; empty where there is none.
std::string text_at(const nlohmann::json& object, const std::string& key);

/// The place of the name that is wanted: as it stands, or the one file whose name without folders and extension is
/// that. Without a wish the only one, or the one that is called like the depth. `option` is the program's, `what` the
/// kind of things.
std::size_t chosen(const std::filesystem::path& file, const std::vector<std::string>& names, const std::string& wanted,
                   const std::filesystem::path& depth, const std::string& what, const std::string& option);

/// The camera file's keys for a camera matrix, whose rows have `columns` numbers.
nlohmann::json intrinsics_of(const std::filesystem::path& file, const std::vector<double>& matrix, std::size_t columns,
                             const std::string& name);

/// The camera file's "lens" of OpenCV's coefficients, of which 14 end with a tilt that must be 0; empty where all are 0.
/// Throws: Error where no lens has so many, or where the lens is no function of its rays.
nlohmann::json opencv_lens(const std::filesystem::path& file, std::vector<double> k, const std::string& name);

/// The same of its fisheye.
nlohmann::json fisheye_lens(const std::filesystem::path& file, const std::vector<double>& k, const std::string& name);

/// Four rows of four, as the camera file has a matrix.
nlohmann::json rows_of(const Eigen::Matrix4d& matrix);

} // namespace fathom::io
