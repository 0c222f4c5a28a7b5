#pragma once

#include "description/result.hpp"
#include "description/value.hpp"

#include <fathom/normals.hpp>

namespace fathom::description {

template <typename Visitor, Is<NormalsOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("method", in<NormalMethod>(o.method), {"automatic", "neighbours", "least-squares"},
      "how slopes are found: from neighbours on the same surface, or from a plane fitted to a window, for quantised "
      "depth (least-squares). automatic fits for depth of 16 bits and fewer and for noise");
    v("max_error", in<&MaxError::value>(o.method), tolerated_error,
      "mean error in degrees, instead of a method: takes the fastest method whose measured error is at most this in "
      "every scene of docs/performance.md");
    v("noise", o.noise, from_to_less_than(0, 1),
      "standard deviation of a sensor's noise over the depth, such as 9e-4: planes are fitted to wider windows");
    v("tolerance", o.tolerance, above(0), "how far depth may be off, in half steps of its storage");
    v("space", o.space, {"view", "world"},
      "axes of the normals: the camera's or the world's, which need the camera's view matrix");
    v("channels", o.channels, one_of(3.0, 4.0),
      "x, y and z; with 4 also the validity: 1, or 0 where there is no normal");
}

struct NormalsCall {
    static constexpr Said said{
        .name = "normals",
        .summary = "Turns stored depth into surface normals, in the camera's axes or the world's.",
        .notes =
            R"(The result is three float32 a pixel. Normals have length 1 and point towards the camera. An EXR holds them as
N.X N.Y N.Z. Invalid and background pixels have 0 0 0. A .png holds ½n + ½ in 16 bits, and black for no normal.

Example:
  fathom normals frame.exr --camera camera.json -o frame.normals.exr --space world)",
        .group = "Normals",
        .excluding = {{{"noise", {"max_error"}}}}};

    NormalsOptions options = {};
    Image result = {};

    void run(const StoredDepth& stored, const Launch& launch) const { normals(stored, result, options, launch); }
};

template <typename Visitor>
void describe_results(const Visitor& v, NormalsCall& call, const StoredDepth& stored) {
    v("result", call.result, true, floats(stored, call.options.channels),
      directions("N.X N.Y N.Z", "of length 1, or 0, but for rounding"),
      "of unit length, towards the camera. Invalid and background pixels are 0, 0, 0");
}

} // namespace fathom::description
