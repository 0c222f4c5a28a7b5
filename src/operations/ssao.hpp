#pragma once

#include "camera/eye_rays.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/pixel_lattice.hpp"
#include "operations/slices.hpp"
#include "params.h"

#include <fathom/ssao.hpp>

namespace fathom {

/// What a slope may be off by, in errors of inverse depth: one neighbour's difference.
inline constexpr float slope_errors_neighbours = 2;

/// How the pixels lie when split into planes of one sampling pattern each. Pure: no device.
params::split_params split_parameters(const PixelLattice& lattice);

/// Constants of the occlusion kernels, but for `slope_errors`. Of the table only its counts are used. Pure: no device.
params::occlusion_params occlusion_parameters(const Camera& camera, const EyeRays& eye, const InverseDepthError& error,
                                              double radius, const SsaoOptions& options, const SliceTable& table);

} // namespace fathom
