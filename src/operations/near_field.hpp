#pragma once

#include <fathom/dof_masks.hpp>

#include <cstddef>

namespace fathom {

/// The passes of `dof_masks` that look around a pixel for near discs: those that were asked for, from `masks.coc` into
/// images that start at their buffer's first element and whose rows are as long as a new image's.
void near_field(const StoredDepth& stored, const DofMasksOptions& options, const DofMasks& masks);

/// Bytes that these passes take for themselves.
std::size_t near_field_bytes(int width, int height, const DofMasksOptions& options);

} // namespace fathom
