#pragma once

#include <fathom/dof_masks.hpp>

namespace fathom {

/// How many rows the weights of near discs are held of at a time, so that what these passes take for themselves keeps to the
/// device's budget. 0 where none are needed.
/// Throws: Error that names the budget that these passes need.
int near_field_rows(const StoredDepth& stored, const DofMasksOptions& options);

/// The passes of `dof_masks` that look around a pixel for near discs: those that were asked for, from `masks.coc`, so many rows
/// of weights at a time.
void near_field(const StoredDepth& stored, const DofMasksOptions& options, const DofMasks& masks, int rows_at_once);

} // namespace fathom
