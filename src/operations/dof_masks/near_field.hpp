#pragma once

#include "operations/bands.hpp"

#include <fathom/dof_masks.hpp>

#include <vector>

namespace fathom {

/// Bytes that the passes below take for these pixels of a camera's image, with weights of so many rows of blocks.
std::size_t near_field_bytes(const Region& pixels, const DofMasksOptions& options, int rows_of_blocks);
int rows_of_blocks(const Region& pixels);

/// Rows of blocks that the weights of near discs are held of at a time, so that what these passes take for themselves keeps to the
/// device's budget.
/// Throws: Error that names the budget that these passes need.
std::vector<Band> bands_of_weights(const StoredDepth& stored, const DofMasksOptions& options);

/// The passes of `dof_masks` that look around a pixel for near discs: those that were asked for, from `masks.coc`, with weights of
/// so many rows of blocks at a time.
void near_field(const StoredDepth& stored, const DofMasksOptions& options, const DofMasks& masks,
                const std::vector<Band>& weighed);

} // namespace fathom
