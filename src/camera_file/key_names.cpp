// Where keys of the camera file stand, and what other programs call them.
#include "key_names.hpp"

#include <algorithm>
#include <initializer_list>
#include <utility>

namespace fathom::io {

std::string object_of(std::string_view key) {
    const auto is_one_of = [&](std::initializer_list<std::string_view> keys) {
        return std::ranges::find(keys, key) != keys.end();
    };
    return is_one_of({"fov_x_deg", "fov_y_deg", "aspect", "reversed"}) ? "perspective"
           : is_one_of({"fx", "fy", "cx", "cy"})                       ? "intrinsics"
           : is_one_of({"left", "right", "bottom", "top"})             ? "orthographic"
                                                                       : "";
}

std::string key_for(std::string_view name) {
    constexpr const char* angle = "\"fov_y_deg\" or \"fov_x_deg\", in degrees, in \"perspective\"";
    constexpr const char* calibration = "\"fx\", \"fy\", \"cx\" and \"cy\" in \"intrinsics\"";
    constexpr const char* lens = "\"lens\": {\"model\": \"brown\", \"k\": [k1, k2, p1, p2, k3]}, or another model";
    for (const auto& [other, ours] : std::initializer_list<std::pair<std::string_view, const char*>>{
             {"fov", angle},
             {"field_of_view", angle},
             {"fovy", "\"fov_y_deg\", in degrees, in \"perspective\""},
             {"fov_y", "\"fov_y_deg\", in degrees, in \"perspective\""},
             {"vfov", "\"fov_y_deg\", in degrees, in \"perspective\""},
             {"fovx", "\"fov_x_deg\", in degrees, in \"perspective\""},
             {"fov_x", "\"fov_x_deg\", in degrees, in \"perspective\""},
             {"hfov", "\"fov_x_deg\", in degrees, in \"perspective\""},
             {"K", calibration},
             {"camera_matrix", calibration},
             {"focal_length", calibration},
             {"D", lens},
             {"k", lens},
             {"k1", lens},
             {"distortion", lens},
             {"distortion_coefficients", lens},
             {"distortion_coeffs", lens},
             {"dist_coeffs", lens},
             {"znear", "\"near\""},
             {"near_plane", "\"near\""},
             {"clip_start", "\"near\""},
             {"zfar", "\"far\""},
             {"far_plane", "\"far\""},
             {"clip_end", "\"far\""},
             {"depth_scale", "\"scale\", in scene units a stored unit: 0.001 for millimetres"},
             {"nodata", "\"missing\""},
             {"focal_length_mm", "\"lens_mm\""},
             {"focus", "\"focus_distance\", in scene units"},
             {"radius", "\"ao_distance\", in scene units"},
         })
        if (name == other)
            return ours;
    return {};
}

} // namespace fathom::io
