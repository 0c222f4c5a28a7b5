#pragma once

#include "description/field.hpp"
#include "description/range.hpp"

#include <fathom/normals.hpp>

namespace fathom::description {

inline constexpr const char* normals_summary =
    "Turns stored depth into surface normals, in the camera's axes or the world's.";

template <typename Visitor, Is<NormalsOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("method", in<NormalMethod>(o.method), {"automatic", "neighbours", "least-squares"},
      "how slopes are found: from neighbours on the same surface, or from a plane fitted to a window, for quantised "
      "depth "
      "(least-squares). automatic fits for depth of 16 bits and fewer and for noise");
    v("max_error", in<&MaxError::value>(o.method), above(0).or_infinite(),
      "mean error in degrees, instead of a method: takes the fastest method whose measured error is at most this in "
      "every "
      "scene of docs/performance.md",
      "none");
    v("noise", o.noise, from_to_less_than(0, 1),
      "standard deviation of a sensor's noise over the depth, such as 9e-4: planes are fitted to wider windows");
    v("tolerance", o.tolerance, above(0), "how far depth may be off, in half steps of its storage");
    v("space", o.space, {"view", "world"},
      "axes of the normals: the camera's or the world's, which need the camera's view matrix");
    v("channels", o.channels, one_of(3.0, 4.0),
      "x, y and z; with 4 also the validity: 1, or 0 where there is no normal");
}

} // namespace fathom::description
