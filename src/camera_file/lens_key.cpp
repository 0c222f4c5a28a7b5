// The key "lens" of the camera file: a model by its name, its coefficients, or the angles of a panorama.
#include "lens_key.hpp"

#include <numbers>

namespace fathom::io {
namespace {

// The ends of a panorama in degrees, in rising order.
std::vector<double> ends_of(const JsonObject& own, const char* key, double most) {
    constexpr double rounding = 1e-4; // of radians in floats, as Blender keeps them
    auto ends = own.numbers(key, 2).value_or(std::vector{-most / 2, most / 2});
    const double beyond = ends[1] - ends[0] - most;
    if (!(ends[1] > ends[0] && beyond <= rounding))
        own.refuse_value(key, "must be the lower and the higher end in degrees, at most " +
                                  std::to_string(static_cast<int>(most)) + " apart");
    if (beyond > 0) {
        ends[0] += beyond / 2;
        ends[1] = ends[0] + most;
    }
    if (most == 180 && !(ends[0] >= -90 - rounding && ends[1] <= 90 + rounding))
        own.refuse_value(key, "must be from -90 to 90, the poles; 0 is the horizon");
    return ends;
}

// None for a cube's face.
std::optional<LensLaw> law_of(const JsonObject& own) {
    const auto known = [](LensLaw law) { return std::pair{to_string(law), std::optional(law)}; };
    using enum LensLaw;
    if (own.string("model") == "inverse_brown_conrady")
        own.refuse_value("model", "gives rays of pixels, and \"brown\" pixels of rays; write the rays into an image "
                                  "(\"lens\": {\"rays\": FILE})");
    const auto law = own.one_of<std::optional<LensLaw>>("model", {known(brown),
                                                                  known(equidistant),
                                                                  known(equisolid),
                                                                  known(stereographic),
                                                                  known(opencv_fisheye),
                                                                  known(double_sphere),
                                                                  known(blender_polynomial),
                                                                  known(equirectangular),
                                                                  {"cube-face", std::nullopt}});
    if (!law)
        own.refuse_missing("model", "it is the lens's name, such as \"brown\" or \"opencv-fisheye\"");
    return *law;
}

} // namespace

std::optional<LensKey> read_lens_key(const JsonObject& json, Encoding encoding) {
    if (!json.has("lens"))
        return std::nullopt;
    LensKey key{json.object("lens", {"model", "rays", "k", "longitude_deg", "latitude_deg"})};
    using enum LensLaw;
    if (const auto image = key.own.string("rays")) {
        if (key.own.has("model"))
            key.own.refuse_whole("has both \"model\" and \"rays\"; keep one");
        key.law = rays;
        key.rays = json.file().parent_path() / *image;
    } else {
        key.law = law_of(key.own);
    }
    for (const char* each : {"longitude_deg", "latitude_deg"})
        if (key.own.has(each) && key.law != equirectangular)
            key.own.refuse_value(each, "is for the model \"equirectangular\"");
    if (key.own.has("k") && key.has_projection())
        key.own.refuse_value("k", "is for lenses with coefficients");
    if (json.has_within("perspective", "reversed"))
        json.refuse_whole("has both \"lens\" and \"reversed\", which is of a \"perspective\"; beside \"intrinsics\" "
                          "a reversed depth buffer has \"depth_range\": [1, 0]");
    for (const char* each : {"projection", "perspective", "orthographic", "oblique_near_plane"})
        if (json.has(each))
            json.refuse_whole(std::string("has both \"lens\" and \"") + each +
                              (key.has_projection() ? "\"; such a lens needs none, so leave it out"
                                                    : "\"; a lens stands beside \"intrinsics\""));
    if (key.has_projection() && json.has("intrinsics"))
        json.refuse_whole("has both \"intrinsics\" and a \"lens\" that needs none; leave \"intrinsics\" out");
    if (key.law && key.law != brown && encoding == Encoding::window)
        json.refuse_whole(
            "has a \"lens\", and its values are a depth buffer's (\"encoding\": \"window\", the default), "
            "which only a projection and \"brown\" have; say what they are: \"view-z\" or \"ray-distance\"");
    return key;
}

RayReader& ray_reader() {
    static RayReader reader;
    return reader;
}

std::vector<double> without_tilt(std::vector<double> k) {
    constexpr std::size_t with_tilt = 14, without = 12;
    if (k.size() == with_tilt && k[12] == 0 && k[13] == 0)
        k.resize(without);
    return k;
}

LensModel lens_model(const LensKey& key, const Intrinsics& intrinsics) {
    if (key.law == LensLaw::rays) {
        if (!ray_reader())
            key.own.refuse_value(
                "rays",
                "is an image, which this program has no reader for; link fathom::fathom_io and call import_camera");
        return lens_of_rays(ray_reader()(key.rays));
    }
    if (key.law != LensLaw::equirectangular)
        return {*key.law,      intrinsics.fx, intrinsics.fy,
                intrinsics.cx, intrinsics.cy, without_tilt(key.own.list("k").value_or(std::vector<double>{}))};
    constexpr double degree = std::numbers::pi / 180;
    const auto longitude = ends_of(key.own, "longitude_deg", 360), latitude = ends_of(key.own, "latitude_deg", 180);
    const double fx = intrinsics.width / ((longitude[1] - longitude[0]) * degree),
                 fy = intrinsics.height / ((latitude[1] - latitude[0]) * degree);
    return {*key.law, fx, fy, -longitude[0] * degree * fx, latitude[1] * degree * fy};
}

LensKey read_raw_lens(const JsonObject& json) {
    if (json.has("lens"))
        json.refuse_whole("has both \"lens\" and \"raw_lens\", which was undone; keep one");
    LensKey key{json.object("raw_lens", {"model", "k", "intrinsics"})};
    key.law = law_of(key.own);
    if (key.has_projection())
        key.own.refuse_value("model", "has no distortion that could be undone");
    if (!key.own.has("intrinsics"))
        key.own.refuse_missing("intrinsics", "they are fx, fy, cx and cy of the raw image");
    return key;
}

} // namespace fathom::io
