// Cameras from other programs' files become keys of the camera file, so that one reader checks them all.
#include "imported.hpp"

#include "file.hpp"
#include "json_object.hpp"
#include "known_words.hpp"
#include "lens_key.hpp"

#include "lens/laws.hpp"
#include "text.hpp"

#include <fathom/presets.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>

namespace fs = std::filesystem;
using nlohmann::json;

namespace fathom::io {
namespace {

/// A camera file, a key on each line.
std::string laid_out(const json& keys) {
    std::string text;
    for (const std::string& key : camera_keys())
        if (keys.contains(key))
            text += (text.empty() ? "  \"" : ",\n  \"") + key +
                    "\": " + keys[key].dump(-1, ' ', false, json::error_handler_t::replace);
    return "{\n" + text + "\n}\n";
}

/// Replaces what both have, within objects, too.
void override(json& keys, json by) {
    for (const char* key : {"near", "far"}) {
        bool inside = false; // of a projection, which has the ends of its own
        for (const char* object : {"perspective", "orthographic"})
            if (by.contains(key) && keys.contains(object) && keys[object].contains(key)) {
                keys[object][key] = by[key];
                inside = true;
            }
        if (inside && !keys.contains(key))
            by.erase(key);
    }
    merge(keys, by);
}

/// The only one of the names that is called like this file, whatever folders it lies in: "a.jpg" for a.jpg,
/// a.jpg.depth.tif, a.png.
std::optional<std::size_t> called_like(const std::vector<std::string>& names, const fs::path& wanted) {
    const std::string name = wanted.filename().string(), stem = wanted.stem().string();
    const std::function<bool(const fs::path&)> rules[] = {
        [&](const fs::path& each) { return each.filename() == name; },
        [&](const fs::path& each) { return name.starts_with(each.filename().string() + "."); },
        [&](const fs::path& each) { return each.stem() == stem; }};
    for (const auto& rule : rules)
        if (std::ranges::count_if(names, rule) == 1)
            return static_cast<std::size_t>(std::ranges::find_if(names, rule) - names.begin());
    return std::nullopt;
}

/// Lets the camera refuse an image of another aspect: it was rendered with a part of the view, or more of it.
void check_aspect(const fs::path& file, CameraFile& camera, double aspect) {
    constexpr double rounding = 0.01; // of an image's size to whole pixels
    camera.projection_for = [file, aspect, projection = camera.camera.projection](int width, int height) {
        if (std::abs(width / (height * aspect) - 1) > rounding)
            refuse(file, text("has the aspect ", aspect, ", the image has ", ImageSize{width, height},
                              "; render it with that aspect, or leave \"aspectRatio\" out"));
        return projection;
    };
}

json lens_keys(const fs::path& file, LensLaw law, const std::vector<double>& k, const std::string& name) {
    try {
        static_cast<void>(lens::Laws({law, 1, 1, 0, 0, k}));
    } catch (const std::invalid_argument& refused) {
        refuse(file, "\"" + name + "\": " + refused.what());
    }
    return {{"model", to_string(law)}, {"k", k}};
}

} // namespace

std::size_t chosen(const fs::path& file, const std::vector<std::string>& names, const std::string& wanted,
                   const fs::path& depth, const std::string& what, const std::string& option) {
    if (wanted.empty()) {
        if (names.size() == 1)
            return 0;
        if (const auto like = depth.empty() ? std::nullopt : called_like(names, depth))
            return *like;
        refuse(file, "has " + std::to_string(names.size()) + " " + what + "s; say which with " + option + ": " +
                         listed(names));
    }
    if (std::ranges::count(names, wanted) > 1)
        refuse(file, "has several " + what + "s \"" + wanted + "\"; say its index with " + option);
    if (const auto at = std::ranges::find(names, wanted); at != names.end())
        return static_cast<std::size_t>(at - names.begin());
    if (const auto like = option == "--image" ? called_like(names, wanted) : std::nullopt)
        return *like;
    refuse(file, "has no " + what + " \"" + wanted + "\" (" + option + "); the nearest are " +
                     listed(nearest_words(names, wanted, 3)));
}

json intrinsics_of(const fs::path& file, const std::vector<double>& matrix, std::size_t columns,
                   const std::string& name) {
    const auto at = [&](std::size_t row, std::size_t column) { return matrix[row * columns + column]; };
    if (at(0, 0) == 0 || at(1, 1) == 0) // below 0 they have a cure of their own
        refuse(file, "\"" + name + "\": is not calibrated, its focal lengths are 0; calibrate the camera");
    if (at(0, 1) != 0)
        refuse(file, "\"" + name +
                         "\": has a skew, which neither OpenCV nor ROS applies; set it to 0 if they made the image");
    if (at(1, 0) != 0 || at(2, 0) != 0 || at(2, 1) != 0 || at(2, 2) != 1)
        refuse(file, "\"" + name + "\": must have the rows [fx, 0, cx], [0, fy, cy], [0, 0, 1]; is it transposed?");
    return {{"fx", at(0, 0)}, {"fy", at(1, 1)}, {"cx", at(0, 2)}, {"cy", at(1, 2)}, {"pixel_origin", "centre"}};
}

json opencv_lens(const fs::path& file, std::vector<double> k, const std::string& name) {
    if (std::ranges::all_of(k, [](double each) { return each == 0; }))
        return {};
    return lens_keys(file, LensLaw::brown, without_tilt(k), name);
}

json fisheye_lens(const fs::path& file, const std::vector<double>& k, const std::string& name) {
    return lens_keys(file, LensLaw::opencv_fisheye, k, name);
}

json rows_of(const Eigen::Matrix4d& matrix) {
    json rows = json::array();
    for (Eigen::Index r = 0; r < 4; ++r)
        rows.push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
    return rows;
}

std::string text_at(const json& object, const std::string& key) {
    return object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : std::string();
}

json parsed_json_or_glb(const fs::path& file) {
    const Bytes bytes = read_file(file);
    if (bytes.size() < 4 || std::memcmp(bytes.data(), "glTF", 4) != 0)
        return parsed_json(file, bytes);
    const auto word = [&](std::size_t at) { // little-endian
        return bytes[at] | bytes[at + 1] << 8 | bytes[at + 2] << 16 | std::uint32_t{bytes[at + 3]} << 24;
    };
    constexpr std::size_t header = 20; // magic, version, length; length and type of the first chunk
    constexpr std::uint32_t json_chunk = 0x4e4f534a;
    if (bytes.size() < header || word(8) > bytes.size() || word(12) > bytes.size() - header)
        refuse(file, "is cut short: a binary glTF of " + std::to_string(bytes.size()) + " bytes; copy it again");
    if (word(4) != 2 || word(16) != json_chunk)
        refuse(file, "is no binary glTF of version 2 that begins with its JSON; export it again");
    return parsed_json(file, std::span(bytes).subspan(header, word(12)));
}

ImportedCamera completed(const fs::path& file, Imported imported, const ImportOptions& options) {
    json& keys = imported.keys;
    if (!options.preset.empty()) {
        const json said = parsed_preset("preset " + options.preset, options.preset);
        if (said.contains("preset") && keys.contains("preset") && said["preset"] != keys["preset"])
            refuse(file, "has the preset " + shown(keys["preset"]) + ", not " + shown(said["preset"]) +
                             "; leave one of the two out");
        for (const Preset& preset : presets())
            if (said.value("preset", json()) == preset.name && keys.contains("encoding") &&
                !said.contains("encoding") && keys["encoding"] != json::parse(preset.keys)["encoding"])
                refuse(file, "\"encoding\": " + shown(keys["encoding"]) + " contradicts the preset \"" + preset.name +
                                 "\"; leave one of the two out");
        override(keys, said);
    }
    if (!keys.contains("encoding") && !keys.contains("preset")) {
        if (imported.otherwise.empty() && !imported.cure.empty())
            refuse(file, "does not say what the values of the depth mean; " + imported.cure);
        for (const auto& [key, value] : imported.otherwise.items())
            if (!keys.contains(key))
                keys[key] = value;
        imported.warnings.insert(imported.warnings.end(), imported.doubts.begin(), imported.doubts.end());
    }
    ImportedCamera made{read_camera_keys(file, keys), laid_out(keys), std::move(imported.warnings)};
    if (imported.has_aspect)
        check_aspect(file, made, keys["perspective"]["aspect"].get<double>());
    return made;
}

Imported import_parsed(const fs::path& file, json json, const ImportOptions& options) {
    const bool gltf = is_gltf(json), transforms = !gltf && is_transforms(json), bop = is_bop(json),
               open3d = is_open3d(json);
    if (!options.node.empty() && !gltf)
        refuse(file, "has no nodes, so leave out --node; that is for glTF");
    if (!options.image.empty() && !transforms && !bop && !(open3d && json.contains("parameters")))
        refuse(
            file,
            "has no images, so leave out --image; that is for COLMAP, transforms.json, BOP and Open3D's trajectories");
    if (options.undistorted)
        refuse(file, "is no calibration of OpenCV or ROS, which --undistorted is for; leave it out");
    return gltf                 ? import_gltf(file, json, options)
           : transforms         ? import_transforms(file, std::move(json), options)
           : bop                ? import_bop(file, json, options)
           : open3d             ? import_open3d(file, json, options)
           : is_realsense(json) ? import_realsense(file, json)
                                : Imported{.keys = std::move(json)};
}

} // namespace fathom::io

namespace fathom {

ImportedCamera import_json_camera(const fs::path& file, const ImportOptions& options) {
    return io::completed(file, io::import_parsed(file, io::parsed_json_or_glb(file), options), options);
}

} // namespace fathom
