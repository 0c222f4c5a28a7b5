#pragma once

#include <fathom/dof_masks.hpp>

namespace fathom {

/// The passes of `dof_masks` that look around a pixel: into `masks` go those that were asked for, from `masks.circle`.
void near_layer(const StoredDepth& stored, const DofMasksOptions& options, DofMasks& masks);

} // namespace fathom
