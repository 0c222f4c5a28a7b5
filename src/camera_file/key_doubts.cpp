// Keys of a camera file that can be decoded, but that hardly anybody means.
#include "json_object.hpp"

#include "text.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/presets.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace fathom {
namespace {

using nlohmann::json;

std::optional<double> number_of(const json& object, const char* key) {
    return object.contains(key) && object[key].is_number() ? std::optional(object[key].get<double>()) : std::nullopt;
}

bool near_to(double a, double b, double tolerance) {
    return std::abs(a - b) <= tolerance * std::abs(b);
}

void doubt_perspective(const json& own, double width, double height, std::vector<std::string>& said) {
    for (const char* key : {"fov_y_deg", "fov_x_deg"})
        if (const auto angle = number_of(own, key); angle && *angle < std::numbers::pi)
            said.push_back(text("\"perspective.", key, "\": ", *angle,
                                " is a very narrow view; if these are radians, write ",
                                std::round(*angle * 1800 / std::numbers::pi) / 10, " degrees"));
    const double aspect = width / height; // of no size NaN, which nothing is near to
    if (const auto given = number_of(own, "aspect");
        given && near_to(*given, 1 / aspect, 0.02) && !near_to(aspect, 1, 0.05))
        said.push_back(text("\"perspective.aspect\": ", *given, " is height over width of this image of ", width, " x ",
                            height, "; it is width over height, or leave it out"));
}

void doubt_intrinsics(const json& own, bool from_centre, bool per_millimetre, double width, double height,
                      std::vector<std::string>& said) {
    const auto fx = number_of(own, "fx"), fy = number_of(own, "fy"), cx = number_of(own, "cx"),
               cy = number_of(own, "cy");
    constexpr double least = 8; // pixels: of fewer a part of an image is as likely as the whole
    if (!fx || !fy || !cx || !cy || !(width >= least && height >= least))
        return;
    constexpr double widest = 11.4; // tan(85 degrees): 170 degrees and more
    if (!per_millimetre && (width / 2 / *fx > widest || height / 2 / *fy > widest)) {
        said.push_back(text("\"intrinsics\": fx ", *fx, " and fy ", *fy, " are a few pixels of ", width, " x ", height,
                            "; if they are parts of the width or millimetres, turn them into pixels"));
        return;
    }
    const double x = *cx / width, y = *cy / height;
    const bool turned = near_to(*cx, height / 2, 0.1) && near_to(*cy, width / 2, 0.1) && !near_to(width, height, 0.2);
    if (turned)
        said.push_back(text("\"intrinsics\": cx ", *cx, " and cy ", *cy, " are the middle of an image of ", height,
                            " x ", width, ", and this one has ", width, " x ", height,
                            "; exchange cx and cy, or turn the image"));
    else if (x < 0 || x > 1 || y < 0 || y > 1 || (x > 0.9 && y > 0.9) || (std::max(x, y) < 0.3 && near_to(x, y, 0.15)))
        said.push_back(text("\"intrinsics\": cx ", *cx, " and cy ", *cy, " are far from the middle of ", width, " x ",
                            height,
                            " pixels; is it the calibration of another size? Then scale fx, fy, cx and cy alike"));
    else if (!from_centre && near_to(*cx, (width - 1) / 2, 1e-6) && near_to(*cy, (height - 1) / 2, 1e-6))
        said.push_back(text("\"intrinsics\": cx ", *cx, " and cy ", *cy, " are the middle of ", width, " x ", height,
                            " pixels if they count from the centre of the first one, as calibrations do; say "
                            "\"pixel_origin\": \"centre\""));
}

void doubt_lens(const json& own, double width, double height, std::vector<std::string>& said) {
    constexpr double rounding = 0.02; // of a cut to whole pixels
    if (!(width > 0 && height > 0))
        return;
    const auto is = [&](const char* model) { return own.contains("model") && own["model"] == model; };
    if (is("equirectangular") && !own.contains("longitude_deg") && !own.contains("latitude_deg") &&
        !near_to(width, 2 * height, rounding))
        said.push_back(text("\"lens\": ", width, " x ", height,
                            " pixels are not twice as wide as high, as a picture of all directions is; if a part was "
                            "cut off, say which one is left (\"latitude_deg\": [LOWEST, HIGHEST], \"longitude_deg\"), "
                            "and otherwise \"latitude_deg\": [-90, 90]"));
    if (is("cube-face") && !near_to(width, height, rounding))
        said.push_back(text("\"lens\": ", width, " x ", height,
                            " pixels are not square, as a cube's face is; give the face alone, or a \"perspective\""));
}

} // namespace

std::vector<std::string> key_doubts(const std::string& camera_file, int width, int height) {
    std::vector<std::string> said;
    const json keys = json::parse(camera_file, nullptr, false);
    if (!keys.is_object())
        return said;
    json all = keys;
    for (const Preset& preset : presets()) {
        if (!keys.contains("preset") || keys["preset"] != preset.name)
            continue;
        all = json::parse(preset.keys);
        io::merge(all, keys); // the preset's lens may have ends of its own
        if (preset.is_distorted && !keys.contains("lens") && !keys.contains("raw_lens"))
            said.push_back(text("the depth of \"", preset.name,
                                "\" has the distortion of its lens, and the camera has no \"lens\"; give the "
                                "calibration's coefficients, or take the preset kinect if it was undone"));
    }
    const auto object = [&](const char* key) { return all.contains(key) && all[key].is_object() ? all[key] : json(); };
    if (const json own = object("perspective"); own.is_object())
        doubt_perspective(own, width, height, said);
    if (const json own = object("lens"); own.is_object())
        doubt_lens(own, width, height, said);
    if (const json own = object("intrinsics"); own.is_object()) {
        const json& origin = own.contains("pixel_origin") ? own : all;
        const json lens = object("lens");
        doubt_intrinsics(own, origin.contains("pixel_origin") && origin["pixel_origin"] == "centre",
                         lens.is_object() && lens.value("model", json()) == "blender-polynomial", width, height, said);
    }
    return said;
}

} // namespace fathom
