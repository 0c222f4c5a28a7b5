// The camera of a frame of transforms.json, as nerfstudio and instant-ngp write and read it.
//   transform_matrix: camera to world, x right, y up, -z ahead; pixels count from the corner
// nerfstudio, data conventions and nerfstudio_dataparser.py; instant-ngp, nerf_loader.cu. The world is that of the
// file.
#include "imported.hpp"

#include "file.hpp"
#include "json_object.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fs = std::filesystem;
using nlohmann::json;

namespace fathom::io {
namespace {

constexpr double millimetre = 0.001; // nerfstudio's default of depth_unit_scale_factor

/// A frame's own keys come before the file's.
struct Frame {
    JsonObject own, common;

    const JsonObject& with(const std::string& key) const { return own.has(key) ? own : common; }
    std::optional<double> number(const std::string& key) const { return with(key).number(key); }
};

bool is_panorama(const Frame& frame) {
    return frame.with("camera_model").holds("camera_model", "EQUIRECTANGULAR");
}

/// nerfstudio's panorama: pi (x - cx)/fx to the right and pi (cy - y)/fy up, all directions without these.
json panorama_of(const Frame& frame) {
    json lens{{"model", "equirectangular"}};
    const auto ends = [&](const char* key, const char* focal, const char* middle, const char* size, double sign) {
        const auto f = frame.number(focal), c = frame.number(middle), pixels = frame.number(size);
        if (!f || !c || !pixels || !(*f > 0))
            return;
        const double first = -180 * sign * *c / *f, last = 180 * sign * (*pixels - *c) / *f;
        const bool all = std::abs(std::abs(last - first) - (sign > 0 ? 360 : 180)) < 1e-6;
        if (!all)
            lens[key] = {std::min(first, last), std::max(first, last)};
    };
    ends("longitude_deg", "fl_x", "cx", "w", 1);
    ends("latitude_deg", "fl_y", "cy", "h", -1);
    return lens;
}

/// The lens of nerfstudio's models, and of instant-ngp; empty for a pinhole.
json lens_of(const Frame& frame) {
    constexpr std::array pinholes{"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"};
    constexpr std::array fisheyes{"OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE"};
    const JsonObject& holder = frame.with("camera_model");
    const auto is_one_of = [&](const auto& names) {
        return std::ranges::any_of(names, [&](const char* each) { return holder.holds("camera_model", each); });
    };
    if (holder.has("camera_model") && !is_one_of(pinholes) && !is_one_of(fisheyes))
        holder.refuse_value("camera_model", "is a lens that Fathom does not know; undo it first: colmap "
                                            "image_undistorter makes images and cameras without");
    const auto k = [&](const char* key) { return frame.number(key).value_or(0); };
    if (is_one_of(fisheyes) || frame.with("is_fisheye").boolean("is_fisheye").value_or(false))
        return fisheye_lens(frame.common.file(), {k("k1"), k("k2"), k("k3"), k("k4")}, "k1");
    for (const char* key : {"k4", "k5", "k6"}) // nerfstudio's k4 is that of r⁸, which OpenCV has not
        if (k(key) != 0)
            frame.with(key).refuse_value(
                key, "is a coefficient that Fathom does not know; undo the distortion first: colmap "
                     "image_undistorter makes images and cameras without");
    return opencv_lens(frame.common.file(), {k("k1"), k("k2"), k("p1"), k("p2"), k("k3")}, "k1");
}

std::optional<int> pixels(const Frame& frame, const std::string& key) {
    const auto count = frame.number(key);
    if (count && !(*count >= 1 && *count <= 1e9 && *count == std::floor(*count)))
        frame.with(key).refuse_value(key, "must be a whole number from 1 on");
    return count ? std::optional(static_cast<int>(*count)) : std::nullopt;
}

/// The field of view in radians, under one of its names.
std::optional<double> angle(const Frame& frame, const std::string& degrees, const std::string& radians) {
    auto value = frame.number(degrees);
    if (value)
        *value *= std::numbers::pi / 180;
    else
        value = frame.number(radians);
    if (value && !(*value > 0 && *value < std::numbers::pi))
        frame.common.refuse_whole("\"" + (frame.number(degrees) ? degrees : radians) +
                                  "\" must lie between 0 and 180 degrees");
    return value;
}

json projection_of(const Frame& frame) {
    json keys;
    const auto width = pixels(frame, "w"), height = pixels(frame, "h");
    if (width)
        keys["width"] = *width;
    if (height)
        keys["height"] = *height;
    if (is_panorama(frame))
        return keys;
    auto fx = frame.number("fl_x"), fy = frame.number("fl_y");
    const auto across = angle(frame, "x_fov", "camera_angle_x"), down = angle(frame, "y_fov", "camera_angle_y");
    if (!fx && across && width)
        fx = *width / (2 * std::tan(*across / 2));
    if (!fy && down && height)
        fy = *height / (2 * std::tan(*down / 2));
    if (!fx && !fy && across && !frame.number("cx") && !frame.number("cy")) { // the image gives its size
        keys["perspective"] = {{"fov_x_deg", *across * 180 / std::numbers::pi}};
        return keys;
    }
    if (!fx && !fy)
        frame.common.refuse_whole(
            "has neither \"fl_x\" nor \"camera_angle_x\" with \"w\"; give the focal length in pixels");
    const auto middle = [&](const std::string& key, std::optional<int> size, const std::string& of_size) {
        if (const auto c = frame.number(key))
            return *c;
        if (!size)
            frame.common.refuse_missing(key, "give it or \"" + of_size + "\"");
        return *size / 2.0;
    };
    keys["intrinsics"] = {{"fx", fx.value_or(fy.value_or(0))},
                          {"fy", fy.value_or(fx.value_or(0))},
                          {"cx", middle("cx", width, "w")},
                          {"cy", middle("cy", height, "h")},
                          {"pixel_origin", "corner"}};
    return keys;
}

Eigen::Matrix4d camera_to_world(const Frame& frame) {
    const auto matrix = frame.own.matrix("transform_matrix");
    if (!matrix)
        frame.own.refuse_missing("transform_matrix", "it is the camera's place");
    constexpr double rounding = 1e-3; // of files that people wrote
    const Eigen::Matrix3d turn = matrix->topLeftCorner<3, 3>();
    if (!(turn * turn.transpose()).isApprox(Eigen::Matrix3d::Identity(), rounding))
        frame.own.refuse_value("transform_matrix",
                               "has a scale or a shear, and a camera is only turned and moved; take it out");
    return *matrix;
}

/// What the depth's values mean, if anything says that there is depth.
json encoding_of(const Frame& frame) {
    const bool ngp = frame.common.has("integer_depth_scale");
    const std::string key = ngp ? "integer_depth_scale" : "depth_unit_scale_factor";
    const auto scale = frame.common.number(key);
    if (!scale && !frame.own.has("depth_file_path"))
        return {};
    if (scale && !(*scale > 0))
        frame.common.refuse_value(key, "must be positive");
    return {{"encoding", is_panorama(frame) ? "ray-distance" : "view-z"},
            {"scale", scale.value_or(millimetre)},
            {"missing", 0}};
}

} // namespace

bool is_transforms(const json& json) {
    return json.is_object() && json.contains("frames");
}

Imported import_transforms(const fs::path& file, json transforms, const ImportOptions& options) {
    const json frames = std::move(transforms["frames"]);
    transforms.erase("frames");
    if (!frames.is_array() || frames.empty())
        refuse(file, "\"frames\": " + shown(frames) + " must be a list of frames, and not empty");
    std::vector<std::string> names, depths;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        if (!frames[i].is_object())
            refuse(file, "\"frames[" + std::to_string(i) + "]\": " + shown(frames[i]) + " must be an object, {...}");
        names.push_back(text_at(frames[i], "file_path"));
        const std::string depth = text_at(frames[i], "depth_file_path");
        depths.push_back(depth.empty() ? text_at(frames[i], "depth_path") : depth);
    }
    // A frame's depth names it as well as its picture does.
    const std::string wanted = options.image.empty() ? options.depth.string() : options.image;
    const auto is_its_depth = [&](const std::string& depth) {
        return !depth.empty() && (depth == wanted || fs::path(depth).filename() == fs::path(wanted).filename());
    };
    const bool by_depth = names.size() > 1 && std::ranges::count_if(depths, is_its_depth) == 1;
    const auto place = by_depth ? static_cast<std::size_t>(std::ranges::find_if(depths, is_its_depth) - depths.begin())
                                : chosen(file, names, options.image, options.depth, "image", "--image");
    const Frame frame{{file, "frames[" + std::to_string(place) + "]", frames[place]},
                      {file, "", std::move(transforms)}};
    Imported imported{.keys = projection_of(frame),
                      .otherwise = encoding_of(frame),
                      .cure =
                          "name its source or give the keys: --preset tum, or --preset encoding=view-z,scale=0.001"};
    if (const json lens = is_panorama(frame) ? panorama_of(frame) : lens_of(frame); !lens.empty())
        imported.keys["lens"] = lens;
    imported.keys["camera_to_world"] = rows_of(camera_to_world(frame));
    return imported;
}

} // namespace fathom::io
