#pragma once

#include "description/range.hpp"

#include <fathom/fog.hpp>

namespace fathom::description {

inline constexpr const char* fog_summary = "Lays fog over a picture: uniform, or thinner with the height.";

template <typename Visitor, Is<FogOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("density", o.density, from(0), "fraction of the light lost per scene unit, over a short way");
    v("fog_color", o.fog_color, Three::color,
      "colour of the fog in linear light and in the picture's order of channels: R, G, B in files, B, G, R in OpenCV");
    v("start", o.start, from(0), "distance along the ray at which the fog begins, scene units");
    v("max_opacity", o.max_opacity, between(0, 1), "no pixel is fogged more than this");
    v("height_falloff", o.height_falloff, from(0),
      "height fog: the density falls by exp(−height_falloff · h) over a height h, per scene unit. Needs the camera's "
      "view "
      "matrix");
    v("reference_height", o.reference_height, any_number, "height in the world where the density is `density`");
    v("up", o.up, Three::direction, "the world's up axis, of any length");
    v("sky", o.sky, {"fog", "keep"}, "the background: infinitely far away, or left alone");
    v("alpha", o.alpha, {"premultiplied", "straight"},
      "says whether the picture's alpha is multiplied into its colours. The program knows it from the file");
}

} // namespace fathom::description
