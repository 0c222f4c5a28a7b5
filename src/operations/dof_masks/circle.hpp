#pragma once

#include "camera/circle_form.hpp"
#include "params.h"
#include "runtime/launch.hpp"

#include <fathom/camera.hpp>
#include <fathom/device.hpp>
#include <fathom/dof_masks.hpp>
#include <fathom/lens.hpp>

namespace fathom {

/// Constants of kernels/dof_masks/circle.h, and of the weights of kernels/dof_masks/dof_masks.cl.
params::circle_params circle_parameters(const DepthForm& form, const CircleOfConfusion& circle,
                                        const DofMasksOptions& options, Arithmetic arithmetic);

/// 1 / transition_px; the largest float for a transition of 0.
float inverse_transition(const DofMasksOptions& options);

/// What a kernel that includes circle.h is built for, without its lens.
runtime::Defines circle_defines(const DepthForm& form, const CircleOfConfusion& circle, const Rays& rays,
                                const StoredDepth& stored, int vector_width, bool stream);

} // namespace fathom
