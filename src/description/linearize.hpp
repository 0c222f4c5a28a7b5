#pragma once

#include "description/result.hpp"
#include "description/value.hpp"

#include <fathom/linearize.hpp>

namespace fathom::description {

template <typename Visitor, Is<LinearizeOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("background", o.background, {"inf", "decode", "nan"},
      "what becomes of background pixels: infinity, the far plane's distance (decode), or NaN");
    v("as", o.as, {"view-z", "ray-distance"},
      "what the distance is: along the view axis, or from the camera centre along each pixel's ray");
}

struct LinearizeCall {
    static constexpr Said said{
        .name = "linearize",
        .summary = "Turns stored depth into exact distance along the view axis.",
        .notes =
            R"(The result is float32 in scene units, positive in front of the camera. Rows keep the order of the input. An EXR
holds it as channel Z, and a distance along the ray as channel distance. Invalid values become NaN.

Example:
  fathom linearize frame.exr --camera camera.json -o frame.z.exr
  fathom linearize shots/*.png --camera camera.json -o depth/ --format tif)",
        .group = "Distance",
        .layer = "linear"};

    LinearizeOptions options = {};
    Image result = {};

    void run(const StoredDepth& stored, const Launch& launch) const { linearize(stored, result, options, launch); }
};

template <typename Visitor>
void describe_results(const Visitor& v, LinearizeCall& call, const StoredDepth& stored) {
    v("result", call.result, true, floats(stored, 1),
      lengths(call.options.as == Along::ray ? "distance" : "Z", any_number.or_infinite()),
      "in scene units, positive in front of the camera. Invalid pixels are NaN");
}

} // namespace fathom::description
