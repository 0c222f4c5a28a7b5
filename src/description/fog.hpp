#pragma once

#include "description/result.hpp"
#include "description/value.hpp"

#include <fathom/fog.hpp>

namespace fathom::description {

template <typename Visitor, Is<FogOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("density", o.density, from(0), "fraction of the light lost per scene unit, over a short way");
    v("fog_color", o.fog_color, Kind::color,
      "colour of the fog in linear light, in the order of the picture's channels");
    v("start", o.start, from(0), "distance along the ray at which the fog begins, scene units");
    v("max_opacity", o.max_opacity, between(0, 1), "no pixel is fogged more than this");
    v("height_falloff", o.height_falloff, from(0),
      "height fog: of the density, exp(−X · h) is left at a height h above the reference, X being this value, per "
      "scene unit. Needs the camera's view matrix");
    v("reference_height", o.reference_height, any_number, "height in the world where the fog has its full density");
    v("up", o.up, Kind::direction, "the world's up axis, of any length");
    v("sky", o.sky, {"fog", "keep"}, "the background: infinitely far away, or left alone");
    v("alpha", o.alpha, {"premultiplied", "straight"},
      "says whether the picture's alpha is multiplied into its colours. The program knows it from the file");
    v("whole_pixels", o.whole_pixels, Kind::flag,
      "each pixel of the picture shows one surface, as without antialiasing. Otherwise one at an edge may show two, of "
      "which each gets its own fog");
}

struct FogCall {
    static constexpr Said said{
        .name = "fog",
        .summary = "Lays fog over a picture: uniform, or thinner with the height.",
        .notes =
            R"(Each pixel becomes color (1 - f) + fog color f with f = 1 - exp(-density distance). The distance is that
along the ray, in scene units. Under --height-falloff the density is integrated along the ray in closed form.

Fog covers light, not codes: see --color-space. An alpha stays as it is. A pixel with an invalid depth keeps its
colour. With several inputs, IMAGE and OUT are folders. The picture and the result of an input have its name there.

Example:
  fathom fog frame.exr --color frame.exr --camera camera.json -o foggy.exr --density 0.02
  fathom fog frame.exr --color frame.png --camera camera.json -o foggy.png --density 0.1 --height-falloff 0.5 \
      --up 0,0,1 --fog-color 0.7,0.7,0.75)",
        .arguments = {"color", "density"},
        .group = "Fog",
        .layer = "fog",
        .needing = {{{"reference_height", {"height_falloff"}}, {"up", {"height_falloff"}}}}};

    Image color = {};
    FogOptions options{.density = 0};
    Image result = {};

    void supersample(int) const {}
    void run(const StoredDepth& stored, const Launch& launch) const { fog(stored, color, result, options, launch); }
};

template <typename Visitor, Is<FogCall> Call>
void describe(const Visitor& v, Call& call) {
    v("color", call.color, Kind::picture, "the clear picture");
    describe(v, call.options);
}

template <typename Visitor>
void describe_results(const Visitor& v, FogCall& call, const StoredDepth&) {
    v("result", call.result, true, like(call.color),
      light("each channel between those of the picture within two pixels and the fog's, which counts times alpha where "
            "that is multiplied in"),
      "the picture with fog");
}

} // namespace fathom::description
