#pragma once

#include <fathom/image.hpp>

namespace fathom {

/// Pixels on either side that decide on one.
inline constexpr int mixed_pixels_reach = 2;

/// Of `dof_masks`: 1 where the stored depth lies between the surfaces on both sides of a pixel and on neither.
void mixed_pixels(const StoredDepth& stored, const Image& result);

/// Takes the positions of these pixels away: NaN, and w = 0.
void leave_out_mixed(const StoredDepth& stored, const Image& positions);

} // namespace fathom
