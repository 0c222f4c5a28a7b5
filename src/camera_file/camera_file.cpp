// The camera file: JSON in, a Camera out. Its keys and their defaults stand in docs/camera.md.
#include "json_object.hpp"

#include "file.hpp"
#include "imported.hpp"
#include "lens_key.hpp"

#include "text.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/error.hpp>
#include <fathom/pixel_rays.hpp>
#include <fathom/presets.hpp>

#include <Eigen/LU>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string_view>

namespace fathom {
namespace {

using io::JsonObject;

constexpr double infinity = std::numeric_limits<double>::infinity();

Encoding read_encoding(const JsonObject& json) {
    using enum Encoding;
    const auto known = [](Encoding encoding) { return std::pair{to_string(encoding), encoding}; };
    return json
        .one_of("encoding",
                {known(window), known(view_z), known(ray_distance), known(linear), known(logarithmic),
                 known(exponential), known(median), known(pseudo_linear), known(inverse), known(inverse_range)})
        .value_or(window);
}

std::optional<Packing> read_packing(const JsonObject& json) {
    using enum Packing;
    const auto known = [](Packing packing) { return std::pair{to_string(packing), packing}; };
    return json.one_of("packing", {known(rgb_red_low), known(rgb_red_high), known(rgba_red_low), known(rgba_red_high),
                                   known(uint8), known(uint16_rotated), known(uint16_swapped), known(uint13),
                                   known(uint24), known(uint24_high), known(base_255)});
}

/// Pixels of the image; 0 where neither the file nor the caller knows them.
struct Size {
    int width = 0, height = 0;
    bool known() const { return width > 0 && height > 0; }
};

Convention read_convention(const JsonObject& json) {
    return {
        .clip_z = json.one_of<ClipZ>("clip_z", {{"negative-one-to-one", ClipZ::negative_one_to_one},
                                                {"zero-to-one", ClipZ::zero_to_one}})
                      .value_or(ClipZ::negative_one_to_one),
        .clip_y = json.one_of<ClipY>("clip_y", {{"up", ClipY::up}, {"down", ClipY::down}}).value_or(ClipY::up),
        .view_axes = json.one_of<ViewAxes>("view_axes", {{"opengl", ViewAxes::opengl},
                                                         {"directx", ViewAxes::directx},
                                                         {"opencv", ViewAxes::opencv}})
                         .value_or(ViewAxes::opengl),
    };
}

/// Near and far of a projection: its own, else those of the encoding; the camera takes what it has not.
/// Only the window encoding is made by them. Every other one needs no more than the rays, which are the same for any span,
/// so that `otherwise` does no harm.
DepthSpan read_span(const JsonObject& own, Camera& camera, DepthSpan otherwise) {
    const auto near = own.has("near") ? own.number("near") : camera.near_plane;
    const auto far = own.has("far") ? own.number_or_infinity("far") : camera.far_plane;
    const auto contradicts = [](auto here, auto above) { return here && above && *here != *above; };
    if (camera.encoding == Encoding::window &&
        (contradicts(near, camera.near_plane) || contradicts(far, camera.far_plane)))
        own.refuse_whole("has another \"near\" or \"far\" than the file's top level; give them once");
    camera.near_plane = camera.near_plane ? camera.near_plane : near;
    camera.far_plane = camera.far_plane ? camera.far_plane : far;
    const bool is_window = camera.encoding == Encoding::window;
    const bool of_encoding = !own.has("near") && !own.has("far"); // which may be 0, or run from far to near
    if (near && far && (is_window || !of_encoding || (*near > 0 && *far > *near)))
        return {*near, *far};
    if (is_window)
        own.refuse_missing(near ? "far" : "near", "the encoding \"window\", which is the default, needs near and far; "
                                                  "for distances say \"encoding\": \"view-z\"");
    return otherwise;
}

Projection read_perspective(const JsonObject& json, Camera& camera, Convention convention, Size size) {
    const auto own = json.object("perspective", {"fov_y_deg", "fov_x_deg", "aspect", "near", "far", "reversed"});
    if (own.has("fov_y_deg") == own.has("fov_x_deg"))
        own.refuse_whole("must have one of \"fov_y_deg\" and \"fov_x_deg\"");
    if (own.has("aspect") && !(own.needed("aspect") > 0))
        own.refuse_value("aspect", "must be positive");
    const double aspect =
        own.number("aspect").value_or(size.known() ? static_cast<double>(size.width) / size.height : 1);

    const auto key = own.has("fov_y_deg") ? "fov_y_deg" : "fov_x_deg";
    const auto degrees = own.needed(key);
    if (!(degrees > 0 && degrees < 180))
        own.refuse_value(key, "must lie between 0 and 180");
    auto span = read_span(own, camera, {1, infinity});
    if (own.boolean("reversed").value_or(false))
        span.order = DepthOrder::reversed;
    const auto angle = degrees * std::numbers::pi / 180;
    return perspective(own.has("fov_y_deg") ? angle : 2 * std::atan(std::tan(angle / 2) / aspect), aspect, span,
                       convention);
}

/// What to add to a principal point so that it is counted from the corner of the first pixel.
std::optional<double> read_pixel_origin(const JsonObject& json) {
    return json.one_of<double>("pixel_origin", {{"corner", 0.0}, {"centre", 0.5}});
}

Intrinsics intrinsics_of(const JsonObject& json, Size size) {
    const auto own = json.object("intrinsics", {"fx", "fy", "cx", "cy", "pixel_origin"});
    const double shift = read_pixel_origin(own).value_or(read_pixel_origin(json).value_or(0.0));
    return {.fx = own.needed("fx"),
            .fy = own.needed("fy"),
            .cx = own.needed("cx") + shift,
            .cy = own.needed("cy") + shift,
            .width = size.known() ? size.width : 1,
            .height = size.known() ? size.height : 1};
}

Projection read_orthographic(const JsonObject& json, Camera& camera, Convention convention) {
    const auto own = json.object("orthographic", {"left", "right", "bottom", "top", "near", "far"});
    const FrustumEdges edges{own.needed("left"), own.needed("right"), own.needed("bottom"), own.needed("top")};
    const auto span = read_span(own, camera, {0, 1});
    if (std::isinf(span.far_plane))
        own.refuse_whole("\"far\" is infinity; an orthographic far plane must be at a finite distance");
    return orthographic(edges, span, convention);
}

Projection matrix_of(const JsonObject& json, Convention convention) {
    constexpr std::string_view subject = "the projection matrix ";
    try {
        return from_matrix(*json.matrix("projection"), convention);
    } catch (const std::invalid_argument& error) {
        const std::string_view what = error.what();
        if (what.starts_with(subject))
            json.refuse_value("projection", std::string(what.substr(subject.size())));
        throw;
    }
}

/// A pinhole lens before a sensor, which the image covers: square pixels unless the sensor's height is given, too.
Intrinsics intrinsics_of_lens(const JsonObject& json, Size size) {
    for (const char* key : {"lens_mm", "sensor_mm", "sensor_height_mm"})
        if (json.has(key) && !(json.needed(key) > 0))
            json.refuse_value(key, "must be positive");
    const double width = size.known() ? size.width : 1, height = size.known() ? size.height : 1;
    const double fx = width * json.needed("lens_mm") / json.needed("sensor_mm");
    const double fy =
        json.has("sensor_height_mm") ? height * json.needed("lens_mm") / json.needed("sensor_height_mm") : fx;
    return {.fx = fx,
            .fy = fy,
            .cx = width / 2,
            .cy = height / 2,
            .width = static_cast<int>(width),
            .height = static_cast<int>(height)};
}

/// Makes the lens a projection?
bool has_lens(const JsonObject& json) {
    return json.has("lens_mm") && json.has("sensor_mm");
}

/// Which of the keys the projection has; "lens" where only the lens makes one, "face" where a view of 90 degrees does.
std::string kind_of_projection(const JsonObject& json) {
    if (const auto lens = io::read_lens_key(json, read_encoding(json)); lens && lens->has_projection())
        return "face"; // of a cube; of a panorama its axes alone count
    std::string kind;
    for (const std::string each : {"projection", "perspective", "intrinsics", "orthographic"}) {
        if (!json.has(each))
            continue;
        if (!kind.empty())
            json.refuse_whole("has both \"" + kind + "\" and \"" + each + "\"; keep one");
        kind = each;
    }
    if (kind.empty() && has_lens(json))
        return "lens";
    if (kind.empty() && json.has("lens"))
        json.refuse_whole("has a \"lens\" without \"intrinsics\"; give fx, fy, cx and cy of the calibration, or "
                          "\"lens_mm\" and \"sensor_mm\"");
    if (kind.empty())
        json.refuse_whole(
            "has no projection; give one of \"projection\", \"perspective\", \"intrinsics\", \"orthographic\"");
    return kind;
}

/// Does the projection wait for the image's size?
bool waits_for_size(const JsonObject& json, Size size) {
    const std::string kind = kind_of_projection(json);
    return !size.known() && (kind == "intrinsics" || kind == "lens" ||
                             (kind == "perspective" && !json.has_within("perspective", "aspect")));
}

/// The projection for an image of this size; for some image, without an oblique plane, if it waits for the size.
Projection read_projection(const JsonObject& json, Camera& camera, Size size) {
    const std::string kind = kind_of_projection(json);
    const auto convention = read_convention(json);
    const auto pinhole = [&](const Intrinsics& intrinsics) {
        return perspective(intrinsics, read_span(json, camera, {1, infinity}), convention);
    };
    const auto projection =
        kind == "projection"    ? matrix_of(json, convention)
        : kind == "perspective" ? read_perspective(json, camera, convention, size)
        : kind == "intrinsics"  ? pinhole(intrinsics_of(json, size))
        : kind == "lens"        ? pinhole(intrinsics_of_lens(json, size))
        : kind == "face" ? perspective(std::numbers::pi / 2, 1, read_span(json, camera, {1, infinity}), convention)
                         : read_orthographic(json, camera, convention);
    const auto plane = json.numbers("oblique_near_plane", 4);
    return plane && !waits_for_size(json, size)
               ? with_oblique_near_plane(projection, Eigen::Map<const Eigen::Vector4d>(plane->data()))
               : projection;
}

/// Refuses an encoding without what it takes to decode it.
void check_parameters(const JsonObject& json, const Camera& camera) {
    const auto need = [&](const char* key, const std::optional<double>& value) {
        if (!value)
            json.refuse_missing(key, std::string("the encoding \"") + to_string(camera.encoding) + "\" needs it");
        if (std::isinf(*value))
            json.refuse_whole(std::string("\"") + key + "\" is infinity, which the encoding \"" +
                              to_string(camera.encoding) + "\" cannot have; give a finite one");
    };
    using enum Encoding;
    const Encoding encoding = camera.encoding;
    const auto only = [&](const char* key, bool fits, const char* which) {
        if (json.has(key) && !fits)
            json.refuse_value(key,
                              std::string("is for ") + which + ", and the encoding is \"" + to_string(encoding) + "\"");
    };
    only("scale", is_metric(encoding), "\"view-z\", \"ray-distance\" and \"inverse\"");
    only("offset", encoding == inverse, "\"inverse\"");
    if (camera.along == Along::cube && !json.has("lens"))
        json.refuse_value("along", "is for a picture that was resampled from six faces of a cube, and has a \"lens\", "
                                   "such as {\"model\": \"equirectangular\"}");
    only("along",
         encoding == linear || encoding == inverse || encoding == inverse_range ||
             (json.has("lens") && encoding != ray_distance),
         json.has("lens") ? "all other encodings" : "\"linear\", \"inverse\" and \"inverse-range\"");
    only("from_near_plane", encoding == ray_distance || encoding == logarithmic,
         "\"ray-distance\" and \"logarithmic\"");
    const bool has_both =
        encoding == linear || encoding == exponential || encoding == pseudo_linear || encoding == inverse_range;
    if (has_both || camera.from_near_plane)
        need("near", camera.near_plane);
    if (has_both || encoding == logarithmic)
        need("far", camera.far_plane);
    if (camera.encoding == median)
        need("median", camera.median);
    if (camera.encoding == logarithmic && !(camera.log_c > 0))
        json.refuse_value("log_c", "must be positive");
}

/// World to view: "view", or the inverse of "camera_to_world".
std::optional<Eigen::Matrix4d> read_view(const JsonObject& json) {
    if (json.has("view") && json.has("camera_to_world"))
        json.refuse_whole("has both \"view\" and \"camera_to_world\", its inverse; keep one");
    const std::string key = json.has("camera_to_world") ? "camera_to_world" : "view";
    const auto matrix = json.matrix(key);
    if (!matrix)
        return std::nullopt;
    const Eigen::RowVector4d last(0, 0, 0, 1);
    if (matrix->row(3) != last)
        json.refuse_value(key, matrix->col(3).transpose() == last
                                   ? "is transposed: its fourth column is [0, 0, 0, 1]; write its columns as rows"
                                   : "must have the fourth row [0, 0, 0, 1]; give it without the projection");
    if (!(std::abs(matrix->determinant()) > 0))
        json.refuse_value(key, "must be invertible");
    if (key == "view")
        return matrix;
    Eigen::Matrix4d view = matrix->cast<long double>().inverse().cast<double>();
    view.row(3) << 0, 0, 0, 1;
    return view;
}

const std::vector<std::string> keys{"preset",
                                    "width",
                                    "height",
                                    "rows",
                                    "projection",
                                    "perspective",
                                    "intrinsics",
                                    "orthographic",
                                    "lens",
                                    "raw_lens",
                                    "clip_z",
                                    "clip_y",
                                    "oblique_near_plane",
                                    "depth_range",
                                    "view",
                                    "camera_to_world",
                                    "view_axes",
                                    "pixel_origin",
                                    "encoding",
                                    "near",
                                    "far",
                                    "median",
                                    "log_c",
                                    "scale",
                                    "offset",
                                    "along",
                                    "from_near_plane",
                                    "packing",
                                    "gamma",
                                    "depth_bits",
                                    "background",
                                    "background_from",
                                    "missing",
                                    "lens_mm",
                                    "sensor_mm",
                                    "sensor_height_mm",
                                    "f_stop",
                                    "focus_distance",
                                    "ao_distance"};

/// Takes over what the preset that the file names says about its depth, and refuses a file that does not say the rest.
std::string use_preset(JsonObject& json) {
    const auto name = json.string("preset");
    if (!name)
        return {};
    const Preset* preset = nullptr;
    std::vector<std::string> names;
    for (const Preset& each : presets()) {
        names.push_back(each.name);
        if (each.name == *name)
            preset = &each;
    }
    if (!preset)
        json.refuse_word("preset", names);
    auto own = nlohmann::json::parse(preset->keys);
    if (own.contains("background") && json.holds("missing", own["background"]))
        own.erase("background");                                      // the file says what the value means
    if (const auto scale = json.number("scale"); scale && *scale < 0) // whose values count backwards
        for (const char* key : {"background", "background_from"})
            if (own.contains(key) && own[key].is_number() && own[key] > 0)
                own[key] = -own[key].get<double>();
    if (json.has("along") && own.contains("lens") && own["encoding"] == "ray-distance")
        own["encoding"] = "view-z"; // the file says what the values count along
    if (const auto encoding = json.string("encoding"); encoding && own["encoding"] != nlohmann::json(*encoding)) {
        for (const char* key : {"offset", "near", "far"}) // of the preset's own
            own.erase(key);
        if (!json.has("scale") && (*encoding == "window" || own["encoding"] == "inverse" || *encoding == "inverse"))
            own.erase("scale");
    }
    json.fill_in(own);
    const bool is_matrix = json.has("projection") && own["encoding"] == "window"; // near and far are in it
    for (const auto& [key, meaning] : preset->needs)
        if (!json.has(key) && !json.has_within("perspective", key) && !json.has_within("orthographic", key) &&
            !is_matrix)
            json.refuse_missing(key, "the preset \"" + *name + "\" needs it: " + meaning);
    const bool has_projection = json.has("lens") || json.has("projection") || json.has("perspective") ||
                                json.has("intrinsics") || json.has("orthographic") || has_lens(json);
    if (!has_projection)
        json.refuse_missing(
            preset->projection == "fx" ? "intrinsics" : "perspective." + preset->projection,
            "the preset \"" + *name + "\" needs a projection: " +
                (preset->projection == "fx" ? "fx, fy, cx and cy of the calibration" : "the angle of view in degrees") +
                (preset->usual.empty() ? "" : "; usually " + preset->projection + " is " + preset->usual));
    return *name;
}

/// From which stored value on nothing is there. The word "far" is the far plane as a depth buffer of 24 bits finds it again.
std::optional<double> read_background_from(const JsonObject& json, const Camera& camera) {
    if (json.holds("background_from", "largest-half"))
        return std::nullopt;
    if (!json.holds("background_from", "far"))
        return json.number_or_infinity("background_from");
    if (camera.encoding != Encoding::view_z || !camera.near_plane || !camera.far_plane || !(*camera.near_plane > 0) ||
        !(*camera.far_plane > *camera.near_plane) || std::isinf(*camera.far_plane))
        json.refuse_value("background_from", "is for the encoding \"view-z\", and needs 0 < near < far, a finite one");
    const double steps = 4 * 0x1p-24 * *camera.far_plane / *camera.near_plane; // relative, there
    return *camera.far_plane / camera.scale / (1 + steps);
}

/// Refuses numbers that no lens has.
void check_lens(Camera camera, const LensModel& lens) {
    camera.lens = lens;
    camera.width = camera.height = 1;
    PixelRays{camera};
}

/// The lens, for images of the size that the camera has so far.
void read_lenses(const JsonObject& json, CameraFile& file) {
    Camera& camera = file.camera;
    const Size size{camera.width, camera.height};
    if (const auto lens = io::read_lens_key(json, camera.encoding); lens && lens->law) {
        file.lens_for = [json, lens = *lens](int width, int height) {
            const Size of_image{width, height};
            return io::lens_model(lens, json.has("intrinsics") ? intrinsics_of(json, of_image)
                                        : has_lens(json)       ? intrinsics_of_lens(json, of_image)
                                                               : Intrinsics{1, 1, 0, 0, width, height});
        };
        camera.lens = file.lens_for(std::max(size.width, 1), std::max(size.height, 1));
        if (const auto map = camera.lens->map) { // read once, and for images of its size
            file.lens_for = [model = *camera.lens](int, int) { return model; };
            if ((camera.width && camera.width != map->width) || (camera.height && camera.height != map->height))
                json.refuse_whole(text("is for ", ImageSize{camera.width, camera.height},
                                       " pixels, and its map of rays has ", ImageSize{map->width, map->height}));
            camera.width = map->width;
            camera.height = map->height;
        }
        check_lens(camera, *camera.lens);
    }
    if (json.has("raw_lens")) {
        const io::LensKey raw = io::read_raw_lens(json);
        camera.raw_lens = io::lens_model(raw, intrinsics_of(raw.own, size));
        check_lens(camera, *camera.raw_lens);
    }
}

CameraFile read(JsonObject json) {
    CameraFile file;
    auto& camera = file.camera;
    const bool has_own_scale = json.has("scale");
    file.preset = use_preset(json);
    for (const Preset& each : presets())
        if (each.name == file.preset && !has_own_scale && each.formula.find("metres") != std::string::npos)
            camera.usual_metres = each.usual_metres;
    camera.encoding = read_encoding(json);
    camera.near_plane = json.number("near");
    camera.far_plane = json.number_or_infinity("far");
    camera.median = json.number("median");
    camera.log_c = json.number("log_c").value_or(camera.log_c);
    camera.scale = json.number("scale").value_or(camera.scale);
    if (camera.scale == 0)
        json.refuse_value("scale", "must not be 0");
    camera.offset = json.number("offset").value_or(camera.offset);
    camera.along = json.one_of<Along>("along", {{"axis", Along::axis}, {"ray", Along::ray}, {"cube", Along::cube}})
                       .value_or(camera.along);
    camera.from_near_plane = json.boolean("from_near_plane").value_or(false);
    camera.width = json.count("width").value_or(0);
    camera.height = json.count("height").value_or(0);
    const Size size{camera.width, camera.height};
    camera.projection = read_projection(json, camera, size);
    if (waits_for_size(json, size))
        file.projection_for = [json, camera](int width, int height) {
            Camera copy = camera;
            return read_projection(json, copy, {width, height});
        };
    read_lenses(json, file);
    check_parameters(json, camera);
    camera.rows = json.one_of<Rows>("rows", {{"top-down", Rows::top_down}, {"bottom-up", Rows::bottom_up}})
                      .value_or(Rows::top_down);
    if (const auto range = json.numbers("depth_range", 2)) {
        camera.depth_range = {range->front(), range->back()};
        if (range->front() == range->back())
            json.refuse_value("depth_range", "must have two different ends");
    }
    camera.background = json.holds("background", "none") ? std::numeric_limits<double>::quiet_NaN()
                                                         : json.number_or_infinity("background");
    camera.background_from = read_background_from(json, camera);
    camera.background_from_largest_half = json.holds("background_from", "largest-half");
    camera.missing = json.number_or_infinity("missing");
    camera.depth_bits = json.count("depth_bits");
    if (camera.depth_bits && camera.depth_bits != 32 && (*camera.depth_bits < 1 || *camera.depth_bits > 24))
        json.refuse_value("depth_bits", "must be 1 to 24, or 32");
    camera.view = read_view(json);
    read_pixel_origin(json);
    file.packing = read_packing(json);
    file.gamma = json.holds("gamma", "srgb") ? gamma_of_srgb : json.number("gamma");
    if (file.gamma && !(*file.gamma > 0) && !json.holds("gamma", "srgb"))
        json.refuse_value("gamma", "must be above 0, or \"srgb\"");
    file.lens = {.focal_length_mm = json.number("lens_mm"),
                 .sensor_mm = json.number("sensor_mm"),
                 .f_stop = json.number("f_stop"),
                 .focus = json.number_or_infinity("focus_distance"),
                 .ao_distance = json.number_or_infinity("ao_distance")};
    return file;
}

/// A word about a size that has the image's aspect.
std::string cure_of_size(const Camera& camera, int width, int height) {
    if (!camera.width || !camera.height ||
        static_cast<long long>(camera.width) * height != static_cast<long long>(camera.height) * width)
        return "use the camera of this image";
    return text("use the camera of this image, or scale the camera's width, height and pixels by ",
                static_cast<double>(width) / camera.width);
}

} // namespace

namespace io {

const std::vector<std::string>& camera_keys() {
    return keys;
}

CameraFile read_camera_keys(const std::filesystem::path& file, const nlohmann::json& json) {
    try {
        return read(JsonObject(file, "", json, keys));
    } catch (const std::invalid_argument& error) { // what the projection's builder says
        refuse(file, error.what());
    }
}

} // namespace io

CameraFile read_camera(const std::filesystem::path& file) {
    return io::read_camera_keys(file, io::parsed_json(file));
}

Camera preset_camera(const std::string& text, int width, int height) {
    return camera_for(preset_file(text), width, height);
}

CameraFile preset_file(const std::string& text) {
    const std::string source = "preset " + text;
    return io::read_camera_keys(source, io::parsed_preset(source, text));
}

Camera camera_for(const CameraFile& file, int width, int height) {
    auto camera = file.camera;
    if ((camera.width && camera.width != width) || (camera.height && camera.height != height))
        throw Error(text(
            camera.lens && camera.lens->map ? "the map of rays of the camera's lens is for " : "the camera is for ",
            camera.width ? text(camera.width) : "any", " x ", camera.height ? text(camera.height) : "any",
            " pixels, the image has ", ImageSize{width, height}, "; ", cure_of_size(camera, width, height)));
    camera.width = width;
    camera.height = height;
    if (file.projection_for)
        camera.projection = file.projection_for(width, height);
    if (file.lens_for)
        camera.lens = file.lens_for(width, height);
    return camera;
}

} // namespace fathom
