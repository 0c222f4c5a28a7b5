#pragma once

#include "camera/eye_rays.hpp"

#include <fathom/image.hpp>

namespace fathom {

/// Inverse depth (see EyeRays) of every pixel: one float, NaN for what is no surface; 0 or −infinity for the background, or
/// NaN, too. A pass of the operations that compare neighbouring depths.
void inverse_depth(const StoredDepth& stored, const EyeRays& eye, const Image& result,
                   Background background = Background::inf);

/// Bound of the error of inverse depth q that storing depth caused: constant + linear |q| + quadratic q².
struct InverseDepthError {
    float constant, linear, quadratic;
};

/// Half a step of what the depth was stored in, carried over to q by |dq/dv|, and the roundings of q itself. The step is
/// that of the storage, or of the buffer of `camera.depth_bits` that a float image came from. To first order in the step;
/// what depends on the pixel is taken at its worst. Pure: no device.
InverseDepthError inverse_depth_error(const Camera& camera, Storage storage);

} // namespace fathom
