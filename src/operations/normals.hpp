#pragma once

#include "camera/rays.hpp"
#include "operations/inverse_depth.hpp"
#include "params.h"

#include <fathom/normals.hpp>

namespace fathom {

/// Constants of kernels/normals/normals.cl for rays in the axes of the result, or for those of a lens. Pure: no device.
params::normal_params normal_parameters(const CentreRays* rays, const InverseDepthError& error,
                                        const NormalsOptions& options);

/// The method, also where it is `automatic`.
NormalMethod chosen_method(const NormalsOptions& options, const Tile& tile);

/// How far the window of least squares reaches: from the noise and a pixel's angle, never from the image.
int window_radius(const Camera& camera, double noise);

} // namespace fathom
