// The camera file: JSON in, a Camera out. Its keys and their defaults stand in docs/camera.md.
#include "json_object.hpp"

#include "file.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/error.hpp>

#include <Eigen/LU>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace fathom {
namespace {

using io::JsonObject;

constexpr double infinity = std::numeric_limits<double>::infinity();

Encoding read_encoding(const JsonObject& json) {
    using enum Encoding;
    const auto known = [](Encoding encoding) { return std::pair{to_string(encoding), encoding}; };
    return json
        .one_of("encoding", {known(window), known(view_z), known(ray_distance), known(linear), known(logarithmic),
                             known(exponential), known(median), known(pseudo_linear), known(inverse)})
        .value_or(window);
}

std::optional<Storage> read_packing(const JsonObject& json) {
    using enum Storage;
    const auto known = [](Storage storage) { return std::pair{to_string(storage), storage}; };
    return json.one_of("packing", {known(rgb8_red_low), known(rgb8_red_high), known(uint24), known(uint24_high)});
}

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
    if (near && far)
        return {*near, *far};
    if (camera.encoding == Encoding::window)
        own.refuse_missing(near ? "far" : "near", "the encoding \"window\", which is the default, needs near and far; "
                                                  "for distances say \"encoding\": \"view-z\"");
    return otherwise;
}

Projection read_perspective(const JsonObject& json, Camera& camera, Convention convention) {
    const auto own = json.object("perspective", {"fov_y_deg", "fov_x_deg", "aspect", "near", "far", "reversed"});
    if (own.has("fov_y_deg") == own.has("fov_x_deg"))
        own.refuse_whole("must have one of \"fov_y_deg\" and \"fov_x_deg\"");
    auto aspect = own.number("aspect");
    const auto width = json.count("width"), height = json.count("height");
    if (!aspect && width && height)
        aspect = static_cast<double>(*width) / *height;
    if (!aspect)
        own.refuse_missing("aspect", "it must be there unless \"width\" and \"height\" are");
    if (!(*aspect > 0))
        own.refuse_value("aspect", "must be positive");

    const auto key = own.has("fov_y_deg") ? "fov_y_deg" : "fov_x_deg";
    const auto degrees = own.needed(key);
    if (!(degrees > 0 && degrees < 180))
        own.refuse_value(key, "must lie between 0 and 180");
    auto span = read_span(own, camera, {1, infinity});
    if (own.boolean("reversed").value_or(false))
        span.order = DepthOrder::reversed;
    const auto angle = degrees * std::numbers::pi / 180;
    return perspective(own.has("fov_y_deg") ? angle : 2 * std::atan(std::tan(angle / 2) / *aspect), *aspect, span,
                       convention);
}

Projection read_intrinsics(const JsonObject& json, Camera& camera, Convention convention) {
    const auto own = json.object("intrinsics", {"fx", "fy", "cx", "cy", "pixel_origin"});
    const auto width = json.count("width"), height = json.count("height");
    if (!width || !height)
        json.refuse_missing(width ? "height" : "width", "intrinsics are in pixels of an image of that size");
    const auto to_corner = own.one_of<double>("pixel_origin", {{"corner", 0.0}, {"centre", 0.5}}).value_or(0.0);
    const Intrinsics intrinsics{.fx = own.needed("fx"),
                                .fy = own.needed("fy"),
                                .cx = own.needed("cx") + to_corner,
                                .cy = own.needed("cy") + to_corner,
                                .width = *width,
                                .height = *height};
    return perspective(intrinsics, read_span(json, camera, {1, infinity}), convention);
}

Projection read_orthographic(const JsonObject& json, Camera& camera, Convention convention) {
    const auto own = json.object("orthographic", {"left", "right", "bottom", "top", "near", "far"});
    const FrustumEdges edges{own.needed("left"), own.needed("right"), own.needed("bottom"), own.needed("top")};
    const auto span = read_span(own, camera, {0, 1});
    if (std::isinf(span.far_plane))
        own.refuse_whole("\"far\" is infinity; an orthographic far plane must be at a finite distance");
    return orthographic(edges, span, convention);
}

Projection read_matrix(const JsonObject& json, Convention convention) {
    const auto projection = from_matrix(*json.matrix("projection"), convention);
    // What is ahead has a positive w, or nothing of it would be on the screen.
    const auto w_per_z = projection.matrix(3, 2);
    const bool ahead_is_negative = convention.view_axes == ViewAxes::opengl;
    if (projection.is_perspective() && (ahead_is_negative ? w_per_z > 0 : w_per_z < 0))
        json.refuse_value("projection", std::string("must have ") + (ahead_is_negative ? "-1" : "+1") +
                                            " in its fourth row, third column, for the given \"view_axes\"; say \"" +
                                            (ahead_is_negative ? "directx\" or \"opencv" : "opengl") + "\"");
    return projection;
}

Projection read_projection(const JsonObject& json, Camera& camera) {
    std::string kind;
    for (const std::string each : {"projection", "perspective", "intrinsics", "orthographic"}) {
        if (!json.has(each))
            continue;
        if (!kind.empty())
            json.refuse_whole("has both \"" + kind + "\" and \"" + each + "\"; keep one");
        kind = each;
    }
    if (kind.empty())
        json.refuse_whole(
            "has no projection; give one of \"projection\", \"perspective\", \"intrinsics\", \"orthographic\"");

    const auto convention = read_convention(json);
    const auto projection = kind == "projection"    ? read_matrix(json, convention)
                            : kind == "perspective" ? read_perspective(json, camera, convention)
                            : kind == "intrinsics"  ? read_intrinsics(json, camera, convention)
                                                    : read_orthographic(json, camera, convention);
    const auto plane = json.numbers("oblique_near_plane", 4);
    return plane ? with_oblique_near_plane(projection, Eigen::Map<const Eigen::Vector4d>(plane->data())) : projection;
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
    if (camera.encoding == linear || camera.encoding == exponential || camera.encoding == pseudo_linear)
        need("near", camera.near_plane);
    if (camera.encoding == linear || camera.encoding == exponential || camera.encoding == pseudo_linear ||
        camera.encoding == logarithmic)
        need("far", camera.far_plane);
    if (camera.encoding == median)
        need("median", camera.median);
    if (camera.encoding == logarithmic && !(camera.log_c > 0))
        json.refuse_value("log_c", "must be positive");
}

std::optional<Eigen::Matrix4d> read_view(const JsonObject& json) {
    const auto view = json.matrix("view");
    if (view && view->row(3) != Eigen::RowVector4d(0, 0, 0, 1))
        json.refuse_value("view", "must have the fourth row [0, 0, 0, 1]; is it transposed?");
    if (view && !(std::abs(view->determinant()) > 0))
        json.refuse_value("view", "must be invertible");
    return view;
}

CameraFile read(const std::filesystem::path& path) {
    const JsonObject json(path, {"width",       "height",         "rows",         "projection",
                                 "perspective", "intrinsics",     "orthographic", "oblique_near_plane",
                                 "clip_z",      "clip_y",         "depth_range",  "view",
                                 "view_axes",   "encoding",       "near",         "far",
                                 "median",      "log_c",          "scale",        "packing",
                                 "depth_bits",  "background",     "lens_mm",      "sensor_mm",
                                 "f_stop",      "focus_distance", "ao_distance"});
    CameraFile file;
    auto& camera = file.camera;
    camera.encoding = read_encoding(json);
    camera.near_plane = json.number("near");
    camera.far_plane = json.number_or_infinity("far");
    camera.median = json.number("median");
    camera.log_c = json.number("log_c").value_or(camera.log_c);
    camera.scale = json.number("scale").value_or(camera.scale);
    if (camera.scale == 0)
        json.refuse_value("scale", "must not be 0");
    camera.projection = read_projection(json, camera);
    check_parameters(json, camera);
    camera.width = json.count("width").value_or(0);
    camera.height = json.count("height").value_or(0);
    camera.rows = json.one_of<Rows>("rows", {{"top-down", Rows::top_down}, {"bottom-up", Rows::bottom_up}})
                      .value_or(Rows::top_down);
    if (const auto range = json.numbers("depth_range", 2)) {
        camera.depth_range = {range->front(), range->back()};
        if (range->front() == range->back())
            json.refuse_value("depth_range", "must have two different ends");
    }
    camera.background = json.number_or_infinity("background");
    camera.depth_bits = json.count("depth_bits");
    if (camera.depth_bits && camera.depth_bits != 32 && (*camera.depth_bits < 1 || *camera.depth_bits > 24))
        json.refuse_value("depth_bits", "must be 1 to 24, or 32");
    camera.view = read_view(json);
    file.packing = read_packing(json);
    file.lens = {.lens_mm = json.number("lens_mm"),
                 .sensor_mm = json.number("sensor_mm"),
                 .f_stop = json.number("f_stop"),
                 .focus_distance = json.number_or_infinity("focus_distance"),
                 .ao_distance = json.number_or_infinity("ao_distance")};
    return file;
}

} // namespace

CameraFile read_camera(const std::filesystem::path& file) {
    try {
        return read(file);
    } catch (const std::invalid_argument& error) { // what the projection's builder says
        io::refuse(file, error.what());
    }
}

Camera camera_for(const CameraFile& file, int width, int height) {
    auto camera = file.camera;
    if ((camera.width && camera.width != width) || (camera.height && camera.height != height))
        throw Error("the camera file is for " + (camera.width ? std::to_string(camera.width) : "any") + " x " +
                    (camera.height ? std::to_string(camera.height) : "any") + " pixels, the image has " +
                    std::to_string(width) + " x " + std::to_string(height) + "; use the camera of this image");
    camera.width = width;
    camera.height = height;
    return camera;
}

} // namespace fathom
