// Calibrations in JSON: Open3D's intrinsics and camera parameters, the cameras of a scene of the BOP benchmark, RealSense's intrinsics.
//   x = fx X/Z + cx, y = fy Y/Z + cy, pixels counted from the centre of the first one; x right, y down, z ahead
// Open3D, PinholeCameraIntrinsic: matrices column by column; the extrinsic one takes the world to the camera.
// librealsense, doc/projection.md and rsutil.h: Brown-Conrady is OpenCV's; where it is modified, the tangential part takes points that
// the radial part has moved; the inverse one leads the other way in old releases.
// BOP toolkit, docs/bop_datasets_format.md: cam_K row by row, lengths in mm, and depth_scale from codes to mm.
#include "imported.hpp"

#include "file.hpp"
#include "json_object.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>

namespace fs = std::filesystem;
using nlohmann::json;

namespace fathom::io {
namespace {

std::vector<double> transposed(std::vector<double> m) { // 3 x 3
    std::swap(m[1], m[3]);
    std::swap(m[2], m[6]);
    std::swap(m[5], m[7]);
    return m;
}

void add_pixels(const JsonObject& own, json& keys) {
    for (const char* key : {"width", "height"})
        if (const auto pixels = own.count(key))
            keys[key] = *pixels;
}

constexpr const char* no_values = "name its source or give the keys: --preset kinect, or --preset "
                                  "encoding=view-z,scale=0.001";

bool is_scene(const json& object) {
    const auto is_frame = [](const auto& item) {
        return std::ranges::all_of(item.key(), [](unsigned char c) { return std::isdigit(c) != 0; }) &&
               item.value().is_object() && item.value().contains("cam_K");
    };
    const auto items = object.items();
    return !object.empty() && std::all_of(items.begin(), items.end(), is_frame);
}

/// Millimetres of codes, and metres of the scene.
json values_by(const JsonObject& own) {
    const double millimetres = own.number("depth_scale").value_or(1);
    if (!(millimetres > 0))
        own.refuse_value("depth_scale", "must be positive: how many millimetres a code is");
    return {{"encoding", "view-z"}, {"scale", 0.001 * millimetres}, {"missing", 0}};
}

} // namespace

bool is_open3d(const json& object) {
    const auto has_cameras = [&] {
        return object.contains("parameters") && object["parameters"].is_array() && !object["parameters"].empty() &&
               std::ranges::all_of(object["parameters"], is_open3d);
    };
    return object.is_object() && (has_cameras() || object.contains("intrinsic_matrix") ||
                                  (object.contains("intrinsic") && object["intrinsic"].is_object() &&
                                   object["intrinsic"].contains("intrinsic_matrix")));
}

Imported import_open3d(const fs::path& file, const json& object, const ImportOptions& options) {
    if (object.contains("parameters")) { // a PinholeCameraTrajectory
        std::vector<std::string> names;
        for (std::size_t i = 0; i < object["parameters"].size(); ++i)
            names.push_back(std::to_string(i));
        return import_open3d(
            file, object["parameters"][chosen(file, names, options.image, options.depth, "camera", "--image")],
            options);
    }
    const bool has_place = !object.contains("intrinsic_matrix");
    const JsonObject whole(file, "", object), camera = has_place ? whole.object("intrinsic") : whole;
    Imported imported{.keys = {{"view_axes", "opencv"}}, .cure = no_values};
    add_pixels(camera, imported.keys);
    imported.keys["intrinsics"] =
        intrinsics_of(file, transposed(camera.numbers("intrinsic_matrix", 9).value()), 3, "intrinsic_matrix");
    if (const auto place = whole.numbers("extrinsic", 16); place && has_place)
        imported.keys["view"] = rows_of(Eigen::Map<const Eigen::Matrix4d>(place->data()));
    return imported;
}

bool is_bop(const json& object) {
    return object.is_object() &&
           (is_scene(object) || (object.contains("depth_scale") && object.contains("fx") && object.contains("cx")));
}

Imported import_bop(const fs::path& file, const json& object, const ImportOptions& options) {
    Imported imported{.keys = {{"view_axes", "opencv"}}};
    if (!is_scene(object)) { // the camera of a dataset
        const JsonObject own(file, "", object);
        json& pixels = imported.keys["intrinsics"] = {{"pixel_origin", "centre"}};
        for (const char* key : {"fx", "fy", "cx", "cy"})
            pixels[key] = own.number(key).value_or(0);
        add_pixels(own, imported.keys);
        imported.otherwise = values_by(own);
        return imported;
    }
    std::vector<std::string> numbers, names; // frame 7 is 000007.png
    const auto as_named = [](const std::string& number) {
        const bool is_number = std::ranges::all_of(number, [](unsigned char c) { return std::isdigit(c) != 0; });
        return is_number && number.size() < 6 ? std::string(6 - number.size(), '0') + number : number;
    };
    for (const auto& item : object.items())
        numbers.push_back(item.key());
    std::ranges::transform(numbers, std::back_inserter(names), as_named);
    const std::string wanted = options.image.empty() ? "" : as_named(options.image);
    const std::string& number = numbers[chosen(file, names, wanted, options.depth, "image", "--image")];
    const JsonObject frame(file, number, object[number]);
    imported.keys["intrinsics"] = intrinsics_of(file, frame.numbers("cam_K", 9).value(), 3, number + ".cam_K");
    imported.otherwise = values_by(frame);
    const auto turn = frame.numbers("cam_R_w2c", 9), place = frame.numbers("cam_t_w2c", 3);
    if (turn && place) {
        Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
        view.topLeftCorner<3, 3>() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(turn->data());
        view.topRightCorner<3, 1>() = 0.001 * Eigen::Map<const Eigen::Vector3d>(place->data());
        imported.keys["view"] = rows_of(view);
    }
    return imported;
}

bool is_realsense(const json& object) {
    return object.is_object() && std::ranges::all_of(std::array{"fx", "fy", "ppx", "ppy"},
                                                     [&](const char* key) { return object.contains(key); });
}

Imported import_realsense(const fs::path& file, const json& object) {
    Imported imported{.keys = {{"view_axes", "opencv"}},
                      .cure = "name its source or give the keys: --preset realsense, or --preset "
                              "encoding=view-z,scale=0.0001"};
    const JsonObject own(file, "", object);
    json& pixels = imported.keys["intrinsics"] = {{"pixel_origin", "centre"}};
    for (const auto& [key, name] : {std::pair{"fx", "fx"}, {"fy", "fy"}, {"cx", "ppx"}, {"cy", "ppy"}})
        pixels[key] = own.number(name).value_or(0);
    add_pixels(own, imported.keys);
    const std::vector<double> k = own.numbers("coeffs", 5).value_or(std::vector<double>(5));
    // "distortion.brown_conrady" of Python, "Brown Conrady" of rs-enumerate-devices
    std::string model = lower(object.value("model", json("none")).dump());
    std::erase(model, '"');
    model.erase(0, model.rfind('.') + 1);
    std::ranges::replace_if(
        model, [](char c) { return c == ' ' || c == '-'; }, '_');
    const bool is_brown = model == "brown_conrady", is_modified = model == "modified_brown_conrady",
               bends = std::ranges::any_of(k, [](double each) { return each != 0; });
    if (model != "none" && model != "inverse_brown_conrady" && !is_brown && !is_modified)
        refuse(file, "\"model\": " + shown(object["model"]) +
                         " must be none, brown_conrady, modified_brown_conrady or inverse_brown_conrady");
    if (bends && !is_brown && !(is_modified && k[2] == 0 && k[3] == 0))
        refuse(file, "\"model\": " + shown(object.value("model", json("none"))) +
                         " with coefficients that are not 0 is no lens that Fathom knows; take the depth as its own "
                         "stream has it, and align the colour to it (rs.align(rs.stream.depth))");
    if (const json lens = opencv_lens(file, k, "coeffs"); !lens.empty())
        imported.keys["lens"] = lens;
    return imported;
}

} // namespace fathom::io
