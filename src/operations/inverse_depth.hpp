#pragma once

#include "camera/eye_rays.hpp"
#include "camera/inverse_depth_error.hpp"

#include <fathom/image.hpp>

namespace fathom {

/// Inverse depth (see EyeRays) of every pixel: one float, NaN for an invalid pixel; 0 or −infinity for the background, or
/// NaN, too. A pass of the operations that compare neighbouring depths.
void inverse_depth(const StoredDepth& stored, const EyeRays& eye, const Image& result,
                   Background background = Background::inf);

} // namespace fathom
