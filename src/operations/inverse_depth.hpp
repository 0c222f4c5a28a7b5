#pragma once

#include "camera/centre_rays.hpp"
#include "camera/inverse_depth_error.hpp"

#include "runtime/scratch.hpp"

#include <fathom/image.hpp>

namespace fathom {

/// Inverse depth (see CentreRays) of every pixel: one float, NaN for an invalid pixel; 0 or −infinity for the background,
/// or NaN, too. A pass of the operations that compare neighbouring depths. Around the image lie invalid pixels, three on
/// every side, so that their kernels need not ask where it ends.
Image inverse_depth(runtime::Scratch& scratch, const StoredDepth& stored, const CentreRays& rays,
                    Background background = Background::inf);

} // namespace fathom
