#pragma once

#include "description/range.hpp"

#include <fathom/unproject.hpp>

namespace fathom::description {

inline constexpr const char* unproject_summary =
    "Turns stored depth into exact positions, in the camera's axes or the world's.";

template <typename Visitor, Is<UnprojectOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("space", o.space, {"view", "world"},
      "axes of the positions: the camera's, or the world's, which need the camera's view matrix");
    v("origin", o.origin, Three::finite,
      "the point of the world that positions are counted from. A point in the scene keeps floats exact far away from "
      "the "
      "world's origin");
    v("channels", o.channels, one_of(3.0, 4.0), "x, y and z, and with 4 also w: 1, or 0 where there is no position");
    v("background", o.background, {"inf", "decode", "nan"},
      "background pixels have no position (inf or nan), or lie on the far plane (decode)");
}

} // namespace fathom::description
