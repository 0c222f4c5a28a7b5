#pragma once

#include "camera/centre_rays.hpp"
#include "operations/inverse_depth.hpp"
#include "params.h"

#include <fathom/normals.hpp>

namespace fathom {

/// Constants of kernels/normals.cl for rays in the axes of the result. Pure: no device.
params::normal_params normal_parameters(const CentreRays& rays, const InverseDepthError& error, double tolerance);

/// What `automatic` stands for.
NormalMethod chosen_method(NormalMethod wanted, const StoredDepth& stored);

} // namespace fathom
