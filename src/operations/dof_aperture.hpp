#pragma once

#include "params.h"

#include <fathom/dof.hpp>

#include <vector>

namespace fathom {

/// An aperture laid over the rows of an image: which pixels around one show through it, and how much of each.
///
/// Rows are those of strips, `pitch` rows of pixels each. For a pixel that is the n-th of its strip's, row r from −reach to
/// reach, entries starts[n (2 reach + 1) + r + reach] to before the next are spans of columns around the pixel. Weights are
/// multiples of 2^-bits, so that sums of them and of shares of 1/128 are exact in a float.
struct ApertureSpans {
    int reach;   ///< rows of strips above and below
    int columns; ///< on either side
    std::vector<params::u32> starts;
    std::vector<params::span_params> spans;
};

/// `circle` in horizontal pixels, its sign that of the circle of confusion: before the focus the aperture is upside down.
/// `aspect`: a circle's height over its width. `upright`: is row 0 on top? Pure: no device.
ApertureSpans aperture_spans(const Aperture& aperture, double circle, double aspect, bool upright, int pitch);

} // namespace fathom
