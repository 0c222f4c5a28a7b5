#pragma once

#include "params.h"
#include "runtime/launch.hpp"

#include <fathom/camera.hpp>
#include <fathom/device.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/lens.hpp>

namespace fathom {

/// How kernels/circle.h comes by a circle; the values are the CIRCLE_ constants of params.h.
enum class CircleForm {
    recentred = CIRCLE_RECENTRED, ///< affine in the stored value, in floats
    sum = CIRCLE_SUM,             ///< affine in the stored value and the pixel, in double or two floats
    quotient = CIRCLE_QUOTIENT,   ///< of two such sums
    of_depth = CIRCLE_OF_DEPTH,   ///< the depth is decoded first
};

/// The simplest form that is exact for this decoder and lens. Pure: no device.
CircleForm circle_form(const DepthForm& form, const CircleOfConfusion& circle);

/// Where the depth is decoded first, makes the decoder count it from the lens: the sum of the two would cancel again.
void count_from_lens(DepthForm& form, Rays& rays, const CircleOfConfusion& circle);

/// Constants of kernels/circle.h; of the weights those of dof_masks.cl. Pure: no device.
params::circle_params circle_parameters(const DepthForm& form, const CircleOfConfusion& circle,
                                        const DofMasksOptions& options, Arithmetic arithmetic);

/// 1 / transition_px, the largest float for 0.
float inverse_transition(const DofMasksOptions& options);

/// Finite choices of a kernel that includes circle.h.
runtime::Defines circle_defines(const DepthForm& form, const CircleOfConfusion& circle, const Rays& rays,
                                Storage storage, int vector_width, bool stream);

/// Throws: std::invalid_argument for a circle that is no lens, or none of this camera.
void check_circle(const CircleOfConfusion& circle, const DepthForm& form);

} // namespace fathom
