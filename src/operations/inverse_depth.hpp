#pragma once

#include "camera/centre_rays.hpp"
#include "camera/inverse_depth_error.hpp"

#include "operations/bands.hpp"
#include "runtime/scratch.hpp"

#include <fathom/image.hpp>

#include <cstddef>
#include <string_view>
#include <vector>

namespace fathom {

/// Inverse depth (see CentreRays) of every pixel: one float, NaN for an invalid pixel; 0 or −infinity for the background,
/// or NaN, too. A pass of the operations that compare neighbouring depths. Around the image lie invalid pixels, three on
/// every side, so that their kernels need not ask where it ends.
Image inverse_depth(runtime::Scratch& scratch, const StoredDepth& stored, const CentreRays& rays,
                    Background background = Background::inf);

/// Bytes of such an image.
std::size_t inverse_depth_bytes(int width, int height);

/// The rows of an image in bands that keep to the device's budget, of an operation that takes nothing but inverse depth and looks
/// `reach` rows around a pixel. One band where there is no budget.
/// Throws: Error that names the budget that `what` needs.
std::vector<Band> depth_bands(const StoredDepth& stored, int reach, std::string_view what);

} // namespace fathom
