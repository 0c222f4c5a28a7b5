#pragma once

#include "camera/circle_form.hpp"
#include "operations/bands.hpp"
#include "params.h"

#include <fathom/camera.hpp>
#include <fathom/device.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/image.hpp>
#include <fathom/lens.hpp>

#include <vector>

namespace fathom {

/// Constants of kernels/dof_masks/circle.h, and of the weights of kernels/dof_masks/dof_masks.cl.
params::circle_params circle_parameters(const DepthForm& form, const CircleOfConfusion& circle,
                                        const DofMasksOptions& options, Arithmetic arithmetic);

/// 1 / transition_px; the largest float for a transition of 0.
float inverse_transition(const DofMasksOptions& options);

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

/// Pixels on either side that decide on one.
inline constexpr int mixed_pixels_reach = 2;

/// A pixel is mixed if its stored depth lies between the surfaces on both sides of it and on neither. An image of one channel becomes
/// 1 there, and 0 elsewhere: that of `dof_masks`. Of positions those of such pixels become NaN, and their w 0.
void mixed_pixels(const StoredDepth& stored, const Image& result);

} // namespace fathom
