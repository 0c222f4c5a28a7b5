#pragma once

#include <fathom/image.hpp>

namespace fathom {

/// Pixels on either side that decide on one.
inline constexpr int mixed_pixels_reach = 2;

/// A pixel is mixed if its stored depth lies between the surfaces on both sides of it and on neither. An image of one channel becomes
/// 1 there, and 0 elsewhere: that of `dof_masks`. Of positions those of such pixels become NaN, and their w 0.
void mixed_pixels(const StoredDepth& stored, const Image& result);

} // namespace fathom
