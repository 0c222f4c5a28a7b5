#pragma once

#include <fathom/camera.hpp>

namespace fathom {

/// Bound of the error of inverse depth q that storing depth caused: constant + linear |q| + quadratic q².
struct InverseDepthError {
    float constant, linear, quadratic;
};

/// Half a step of what the depth was stored in, carried over to q by |dq/dv|, and the roundings of q itself. The step is
/// that of the storage, or of the buffer of `camera.depth_bits` that a float image came from. To first order in the step;
/// what depends on the pixel is taken at its worst.
InverseDepthError inverse_depth_error(const Camera& camera, Storage storage);

} // namespace fathom
