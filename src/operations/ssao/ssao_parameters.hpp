#pragma once

#include "camera/rays.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/ssao/pixel_lattice.hpp"
#include "operations/ssao/slices.hpp"
#include "params.h"

#include <fathom/ssao.hpp>

namespace fathom {

/// How far a slope from the difference of two neighbours may be off, in errors of inverse depth.
inline constexpr float slope_errors_neighbours = 2;

/// Lengths are squared in floats. Every visible surface is nearer than this.
inline constexpr double longest_length = 1e18;

/// How the pixels lie when split into planes of one jitter pattern each. Pure: no device.
params::split_params split_parameters(const PixelLattice& lattice);

/// Constants of the occlusion kernels, but for `slope_errors`. Of the table only its counts are used. Pure: no device.
params::occlusion_params occlusion_parameters(const Camera& camera, const CentreRays& rays,
                                              const InverseDepthError& error, double radius, const SsaoOptions& options,
                                              const SliceTable& table);

/// Where the pixels of a lattice lie in an image that begins with row `top` of the stored one. The offset of the first pixel
/// wraps if the image does not have its row.
params::grid_params lattice_grid(const Image& source, const PixelLattice& lattice, int top = 0);

} // namespace fathom
