#pragma once

#include "camera/eye_rays.hpp"

#include <fathom/image.hpp>

namespace fathom {

/// Planar depth (see EyeRays) of every pixel: one float, 0 or −infinity for the background, NaN for what is no surface.
/// A pass of the operations that compare neighbouring depths.
void planar(const StoredDepth& stored, const EyeRays& eye, const Image& result);

} // namespace fathom
