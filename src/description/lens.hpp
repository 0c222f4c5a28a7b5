#pragma once

#include "description/result.hpp"
#include "description/value.hpp"

#include <fathom/lens_arguments.hpp>
#include <fathom/linearize.hpp>

namespace fathom::description {

/// What a photograph's blur takes beside the options of `dof`: `restore_highlights` and `grow_foreground`.
inline constexpr Range highlights = from(1);
inline constexpr Range grown_pixels = whole(0, most_grown_pixels);

/// What a lens has beside its focus, or a struct with the same members that leaves more of them to the camera file. The focus of
/// a `Lens` has to lie in front of the camera centre only, which is below 0 where the centre lies behind z = 0.
template <typename Visitor, typename Lens>
void describe_optics(const Visitor& v, Lens& lens) {
    v("f_stop", lens.f_stop, above(0).or_infinite(), "focal length over the diameter of the aperture",
      "\"f_stop\" of the camera file");
    v("focal_length_mm", lens.focal_length_mm, above(0), "focal length",
      "the projection's, which needs the sensor's width");
    v("sensor_mm", lens.sensor_mm, above(0), "width of the sensor that the whole image covers",
      "the projection's, which needs the focal length");
    v("mm_per_unit", lens.mm_per_unit, above(0), "millimetres in a scene unit");
}

/// Depth without a unit, which needs no lens.
template <typename Visitor, Is<LensArguments> Arguments>
void describe_relative(const Visitor& v, Arguments& lens) {
    v("relative", lens.relative, {"high-is-near", "low-is-near"},
      "the depth has no unit and needs no camera: 8 or 16 bits, or floats, as neural networks give it. Says which "
      "values are near");
    v("blur_px", lens.blur_px, from(0),
      "the CoC for a difference of 1 to the focus, in pixels; codes of 8 and 16 bits count from 0 to 1");
    v("focus_range", lens.focus_range, Kind::fractions, "all of these values are in focus, instead of one pixel's");
    v("relative_range", lens.relative_range, Kind::ends, "stored values that are 0 and 1",
      "floats: the least and the greatest; integers: all codes");
}

template <typename Visitor, Is<LensArguments> Arguments>
void describe(const Visitor& v, Arguments& lens) {
    v("focus", lens.focus, above(0).or_infinite(), "depth that is sharp: distance along the view axis, scene units",
      "\"focus_distance\" of the camera file");
    v("focus_at", lens.focus_at, Kind::pixel,
      "focus on the surface under this pixel, counted from the first pixel of the image (EXR: of its display window)");
    v("focus_along", lens.focus_along, Kind::ray,
      "focus on the depth of the point at this distance along a pixel's ray");
    describe_optics(v, lens);
    describe_relative(v, lens);
}

template <typename Visitor, Is<DepthRepair> Repair>
void describe(const Visitor& v, Repair& repair) {
    v("invalid", repair.invalid, {"keep", "fill"},
      "pixels without a depth keep the picture where no blur reaches them, or take the depth of the farther valid "
      "pixel beside them in the row (in the column, if the row has none)");
    v("grow_foreground", repair.grow_foreground, grown_pixels,
      "each pixel takes the depth of the nearest surface that is at most so many pixels away, for depth that lies "
      "beside its picture's edges");
}

inline constexpr const char* sky_words =
    "blur: the background is infinitely far; sharp: it is in focus; exclude: it is left out like invalid pixels";

/// A circle is given instead of a lens, and one focus.
inline constexpr Relation lens_excluding[] = {
    {"circle", {"focus", "focus_at", "focus_along", "f_stop", "focal_length_mm", "sensor_mm", "mm_per_unit"}},
    {"focus_at", {"focus"}},
    {"focus_along", {"focus", "focus_at"}},
    {"relative", {"focus", "focus_along", "f_stop", "focal_length_mm", "sensor_mm", "mm_per_unit", "circle"}},
    {"focus_range", {"focus_at"}}};

inline constexpr Relation lens_needing[] = {
    {"blur_px", {"relative"}}, {"focus_range", {"relative"}}, {"relative_range", {"relative"}}};

/// A circle of confusion, which a lens may stand for.
template <typename Visitor, typename Circle>
void describe_circle(const Visitor& v, Circle& circle) {
    v("circle", circle, Kind::lens,
      "k and g instead of a lens: circles are k - g/z pixels wide, or g z - k for an orthographic camera",
      "that of the lens");
}

} // namespace fathom::description
