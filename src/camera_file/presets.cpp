// Sources of depth by name. The facts come from the sources' documentation and code: docs/sources.md names them.
#include "file.hpp"
#include "json_object.hpp"
#include "known_words.hpp"

#include <fathom/presets.hpp>

#include <algorithm>
#include <string_view>

namespace fathom {

namespace {

// A sensor's integers on OpenCV's axes, so many a metre, and 0 where nothing was measured.
Preset codes_of_metres(const char* name, const char* source, const std::string& per_metre, const std::string& scale,
                       const char* usual_fx, double usual_metres, bool is_distorted = false) {
    return {.name = name,
            .source = source,
            .formula = "z = v/" + per_metre + " metres, 0 is not measured",
            .keys = R"({"encoding": "view-z", "scale": )" + scale +
                    R"(, "missing": 0, "view_axes": "opencv", "pixel_origin": "centre"})",
            .projection = "fx",
            .usual = usual_fx,
            .is_distorted = is_distorted,
            .usual_metres = usual_metres};
}

} // namespace

const std::vector<Preset>& presets() {
    static const std::vector<Preset> all{
        {.name = "airsim-perspective",
         .source = "AirSim, image type DepthPerspective",
         .formula = "z = v cos a, v metres along the ray, a its angle to the axis",
         .keys = R"({"encoding": "ray-distance", "background_from": 65504})",
         .projection = "fov_x_deg",
         .usual = "90"},
        {.name = "airsim-planar",
         .source = "AirSim, image type DepthPlanar",
         .formula = "z = v metres",
         .keys = R"({"encoding": "view-z", "background_from": 65504})",
         .projection = "fov_x_deg",
         .usual = "90"},
        {.name = "airsim-vis",
         .source = "AirSim, image type DepthVis, 8 bits",
         .formula = "z = 100 v/255 metres, 100 and more is background",
         .keys = R"({"encoding": "view-z", "packing": "uint8", "scale": 0.39215686274509803, "background": 255})",
         .projection = "fov_x_deg",
         .usual = "90"},
        {.name = "apple-disparity",
         .source = "Apple's depth data of type disparity",
         .formula = "z = 1/v metres",
         .keys = R"({"encoding": "inverse", "view_axes": "opencv", "pixel_origin": "corner"})",
         .projection = "fx"},
        codes_of_metres("azure-kinect", "Azure Kinect's depth as it comes from the sensor, distorted", "1000", "0.001",
                        "", 10, true),
        {.name = "blender",
         .source = "Blender's Z or Depth pass",
         .formula = "z = v, 1e10 and more (65504 in half floats) is background",
         .keys = R"({"encoding": "view-z", "background_from": 1e10})",
         .projection = "fov_x_deg"},
        {.name = "blender-panorama",
         .source = "Blender's Z or Depth pass of an equirectangular panorama (Cycles)",
         .formula = "r = v along the ray, 1e10 and more (65504 in half floats) is background",
         .keys = R"({"encoding": "ray-distance", "background_from": 1e10, "lens": {"model": "equirectangular"}})"},
        {.name = "carla",
         .source = "CARLA's raw depth camera",
         .formula = "z = 1000 (R + 256 G + 65536 B)/(2²⁴ − 1) metres",
         .keys =
             R"({"encoding": "view-z", "packing": "rgb-low-first", "scale": 5.9604648328104514e-05, "background": 16777215})",
         .projection = "fov_x_deg",
         .usual = "90"},
        {.name = "colmap",
         .source = "COLMAP's depth maps",
         .formula = "z = v, 0 is not measured",
         .keys = R"({"encoding": "view-z", "missing": 0, "view_axes": "opencv", "pixel_origin": "corner"})",
         .projection = "fx"},
        {.name = "gazebo",
         .source = "Gazebo's depth camera, 32FC1",
         .formula = "z = v metres",
         .keys = R"({"encoding": "view-z", "view_axes": "opencv", "pixel_origin": "centre"})",
         .projection = "fov_x_deg",
         .usual = "60"},
        {.name = "gdepth-inverse",
         .source = "Google's depth map in XMP, Format RangeInverse",
         .formula = "1/z = 1/near + u (1/far − 1/near), u = v/255",
         .keys = R"({"encoding": "inverse-range", "packing": "uint8", "background": "none", "view_axes": "opencv"})",
         .projection = "fx",
         .needs = {{"near", "GDepth:Near"}, {"far", "GDepth:Far"}}},
        {.name = "gdepth-linear",
         .source = "Google's depth map in XMP, Format RangeLinear",
         .formula = "z = near + u (far − near), u = v/255",
         .keys = R"({"encoding": "linear", "packing": "uint8", "background": "none", "view_axes": "opencv"})",
         .projection = "fx",
         .needs = {{"near", "GDepth:Near"}, {"far", "GDepth:Far"}}},
        {.name = "habitat",
         .source = "Habitat-sim's depth sensor",
         .formula = "z = v metres, 0 is background",
         .keys = R"({"encoding": "view-z", "background": 0})",
         .projection = "fov_x_deg",
         .usual = "90",
         .usual_metres = 50},
        {.name = "habitat-lab",
         .source = "Habitat-lab's normalised depth",
         .formula = "z = near + v (far − near), 0 is not measured, 1 is background",
         .keys = R"({"encoding": "linear", "missing": 0})",
         .projection = "fov_x_deg",
         .usual = "90",
         .needs = {{"near", "min_depth of the sensor, 0 by default"},
                   {"far", "max_depth of the sensor, 10 by default"}}},
        {.name = "habitat-panorama",
         .source = "Habitat-sim's equirectangular depth sensor",
         .formula = "r = v metres along the ray, 0 is background",
         .keys = R"({"encoding": "ray-distance", "background": 0, "lens": {"model": "equirectangular"}})",
         .usual_metres = 50},
        {.name = "hypersim",
         .source = "Hypersim's depth_meters",
         .formula = "z = v cos a, v metres along the ray, a its angle to the axis",
         .keys = R"({"encoding": "ray-distance"})",
         .projection = "fov_x_deg",
         .usual = "60",
         .usual_metres = 50},
        {.name = "isaac-planar",
         .source = "Isaac Sim, distance_to_image_plane",
         .formula = "z = v metres",
         .keys = R"({"encoding": "view-z"})",
         .projection = "fov_x_deg"},
        {.name = "isaac-ray",
         .source = "Isaac Sim, distance_to_camera",
         .formula = "z = v cos a, v metres along the ray, a its angle to the axis",
         .keys = R"({"encoding": "ray-distance"})",
         .projection = "fov_x_deg"},
        codes_of_metres("kinect", "Kinect and most depth cameras under ROS, 16UC1", "1000", "0.001", "", 10),
        codes_of_metres("kitti", "KITTI's depth maps, 16 bits", "256", "0.00390625", "721.5377", 1000),
        {.name = "matterport-panorama",
         .source = "Matterport3D's panoramas, 16 bits",
         .formula = "r = v/4000 metres along the ray, 0 is not measured",
         .keys =
             R"({"encoding": "ray-distance", "scale": 0.00025, "missing": 0, "lens": {"model": "equirectangular"}})",
         .usual_metres = 20},
        {.name = "middlebury",
         .source = "Middlebury's disparity, PFM",
         .formula = "z = scale/(v + offset), infinity is not measured",
         .keys = R"({"encoding": "inverse", "missing": "infinity", "view_axes": "opencv", "pixel_origin": "centre"})",
         .projection = "fx",
         .needs = {{"scale", "the baseline times the focal length in pixels"},
                   {"offset", "doffs of calib.txt, in pixels"}}},
        {.name = "mitsuba2",
         .source = "Mitsuba 2's depth integrator",
         .formula = "z = v cos a, v along the ray, a its angle to the axis, 0 is background",
         .keys = R"({"encoding": "ray-distance", "background": 0})",
         .projection = "fov_x_deg"},
        {.name = "mitsuba3",
         .source = "Mitsuba 3's depth integrator",
         .formula = "z = near + v cos a, v along the ray from the near plane, a its angle to the axis, 0 is background",
         .keys = R"({"encoding": "ray-distance", "from_near_plane": true, "background": 0})",
         .projection = "fov_x_deg",
         .needs = {{"near", "near_clip of the sensor, 0.01 by default"}}},
        {.name = "mujoco",
         .source = "MuJoCo's Renderer with depth rendering on",
         .formula = "z = v, far and more is background",
         .keys = R"({"encoding": "view-z", "background_from": "far"})",
         .projection = "fov_y_deg",
         .usual = "45",
         .needs = {{"near", "znear times the model's extent"}, {"far", "zfar times the model's extent"}}},
        {.name = "mujoco-raw",
         .source = "MuJoCo's depth buffer, rows from the bottom",
         .formula = "1/z = 1/near + v (1/far − 1/near)",
         .keys = R"({"encoding": "window", "rows": "bottom-up", "depth_bits": 24})",
         .projection = "fov_y_deg",
         .usual = "45",
         .needs = {{"near", "znear times the model's extent"}, {"far", "zfar times the model's extent"}}},
        {.name = "nuke-depth",
         .source = "Nuke's depth.Z",
         .formula = "z = 1/v, 0 is background",
         .keys = R"({"encoding": "inverse"})",
         .projection = "fov_x_deg"},
        {.name = "pybullet",
         .source = "PyBullet's getCameraImage",
         .formula = "1/z = 1/near + v (1/far − 1/near)",
         .keys = R"({"encoding": "window", "depth_bits": 24})",
         .projection = "fov_y_deg",
         .needs = {{"near", "nearVal of the projection"}, {"far", "farVal of the projection"}}},
        codes_of_metres("realsense", "RealSense, Z16 (a D405 has scale 0.0001)", "1000", "0.001", "", 10),
        codes_of_metres("replica", "Replica as NICE-SLAM renders it, 16 bits", "6553.5", "0.00015259021896696422",
                        "600", 50),
        codes_of_metres("scannet", "ScanNet's depth images, 16 bits", "1000", "0.001", "", 10),
        {.name = "sunrgbd",
         .source = "SUN RGB-D, 16 bits that are rotated left by three",
         .formula = "z = (v/8 + v mod 8 · 2¹³)/1000 metres, v/8 without its fraction, 0 is not measured",
         .keys =
             R"({"encoding": "view-z", "scale": 0.001, "missing": 0, "packing": "uint16-rotated", "view_axes": "opencv", "pixel_origin": "centre"})",
         .projection = "fx",
         .usual_metres = 10},
        {.name = "threejs-rgba",
         .source = "three.js, packDepthToRGBA of r167 and later",
         .formula = "1/z = 1/near + u (1/far − 1/near), u = (R + G/2⁸ + (B + A/255)/2¹⁶)/2⁸",
         .keys = R"({"encoding": "window", "packing": "rgba-high-first", "depth_bits": 24})",
         .projection = "fov_y_deg",
         .usual = "50",
         .needs = {{"near", "the camera's near"}, {"far", "the camera's far"}}},
        {.name = "threejs-rgba-r166",
         .source = "three.js, packDepthToRGBA up to r166",
         .formula = "1/z = 1/near + u (1/far − 1/near), u = (R/2²⁴ + G/2¹⁶ + B/2⁸ + A)/2⁸",
         .keys = R"({"encoding": "window", "packing": "rgba-low-first", "depth_bits": 24})",
         .projection = "fov_y_deg",
         .usual = "50",
         .needs = {{"near", "the camera's near"}, {"far", "the camera's far"}}},
        codes_of_metres("tum", "TUM RGB-D, 16 bits", "5000", "0.0002", "525", 10),
        {.name = "unreal-cm",
         .source = "Unreal Engine's scene depth in centimetres",
         .formula = "z = v/100 metres, 65504 is background, and 1e10 and more",
         .keys = R"({"encoding": "view-z", "scale": 0.01, "background_from": "largest-half"})",
         .projection = "fov_x_deg",
         .usual = "90"},
        {.name = "unreal-meters",
         .source = "Unreal Engine's scene depth in metres",
         .formula = "z = v metres, 65504 is background, and 1e10 and more",
         .keys = R"({"encoding": "view-z", "background_from": "largest-half"})",
         .projection = "fov_x_deg",
         .usual = "90"},
        {.name = "vkitti2",
         .source = "Virtual KITTI 2, 16 bits",
         .formula = "z = v/100 metres, 65535 is background",
         .keys =
             R"({"encoding": "view-z", "scale": 0.01, "background": 65535, "view_axes": "opencv", "pixel_origin": "centre"})",
         .projection = "fx",
         .usual = "725.0087"},
        {.name = "vray-z",
         .source = "V-Ray's Z depth",
         .formula = "z = near + v (far − near)",
         .keys = R"({"encoding": "linear"})",
         .projection = "fov_x_deg",
         .needs = {{"near", "Depth Black, or Depth White where near is white"},
                   {"far", "Depth White, or Depth Black where near is white"}}},
    };
    return all;
}

namespace io {
namespace {

// A number, true or false as JSON has it; all else is text.
nlohmann::json value_of(std::string_view text) {
    const auto value = nlohmann::json::parse(text, nullptr, false);
    return value.is_number() || value.is_boolean() ? value : nlohmann::json(text);
}

} // namespace

nlohmann::json parsed_preset(const std::string& source, const std::string& text) {
    const auto colon = text.find(':'), first_equals = text.find('=');
    const bool is_named = first_equals == std::string::npos || colon < first_equals;
    nlohmann::json file = nlohmann::json::object();
    std::string_view rest = text;
    if (is_named) {
        file["preset"] = text.substr(0, colon);
        rest.remove_prefix(colon == std::string::npos ? text.size() : colon + 1);
    }
    while (!rest.empty()) {
        auto item = rest.substr(0, rest.find(','));
        rest.remove_prefix(std::min(rest.size(), item.size() + 1));
        item.remove_prefix(std::min(item.size(), item.find_first_not_of(' ')));
        const auto equals = item.find('=');
        if (equals == std::string_view::npos || equals == 0 || equals + 1 == item.size())
            refuse(source, "\"" + std::string(item) + "\" is no key and value; write key=value, as in fov_x_deg=90");
        const std::string key(item.substr(0, equals)), object = object_of(key);
        if (key == "perspective" || key == "intrinsics" || key == "orthographic" || key == "preset")
            refuse(source, "\"" + key + "\" does not stand here; write its keys alone, as in fov_x_deg=90");
        auto& target = object.empty() ? file : file[object];
        if (target.contains(key))
            refuse(source, "\"" + key + "\" is given twice; keep one");
        target[key] = value_of(item.substr(equals + 1));
    }
    try {
        static_cast<void>(file.dump()); // throws for a text that is none
    } catch (const nlohmann::json::exception&) {
        refuse(source, "cannot be read; write NAME:key=value,key=value in plain letters");
    }
    return file;
}

} // namespace io
} // namespace fathom
