// Words for messages: where keys of the camera file stand, what other programs call them, and which known word is near to another.
#include "known_words.hpp"

#include <algorithm>
#include <initializer_list>
#include <numeric>
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

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before, above(b.size() + 1), row(b.size() + 1);
    std::iota(above.begin(), above.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before = std::exchange(above, row);
    }
    return above.back();
}

std::vector<std::string> nearest_words(std::vector<std::string> known, std::string_view word, std::size_t most) {
    word = word.substr(0, 100); // longer than whatever is known
    std::vector<std::pair<std::size_t, std::string>> far;
    for (std::string& each : known) {
        const std::size_t edits = edit_distance(each, word);
        far.emplace_back(edits, std::move(each));
    }
    std::ranges::stable_sort(far, {}, &std::pair<std::size_t, std::string>::first);
    far.resize(std::min(far.size(), most));
    known.clear();
    for (auto& each : far)
        known.push_back(std::move(each.second));
    return known;
}

bool is_near(std::string_view known, std::string_view word) {
    return 2 * edit_distance(known, word.substr(0, 100)) <= std::max(known.size(), word.size());
}

} // namespace fathom::io
