#pragma once

#include <fathom/image.hpp>

namespace fathom {

/// Of `dof_masks`: 1 where the stored depth lies between the surfaces on both sides of a pixel and on neither.
void mixed_pixels(const StoredDepth& stored, const Image& result);

} // namespace fathom
