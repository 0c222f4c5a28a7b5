#pragma once

#include "description/range.hpp"

#include <fathom/linearize.hpp>

namespace fathom::description {

inline constexpr const char* linearize_summary = "Turns stored depth into exact distance along the view axis.";

template <typename Visitor, Is<LinearizeOptions> Options>
void describe(const Visitor& v, Options& o) {
    v("background", o.background, {"inf", "decode", "nan"},
      "what becomes of background pixels: infinity, the far plane's distance (decode), or NaN");
}

} // namespace fathom::description
