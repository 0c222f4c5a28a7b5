#pragma once

#include "camera/rays.hpp"

#include "params.h"
#include "runtime/scratch.hpp"

#include <fathom/image.hpp>

#include <cstddef>
#include <functional>
#include <string_view>

namespace fathom {

/// Inverse depth (see CentreRays) of every pixel: one float, NaN for an invalid pixel; 0 or −infinity for the background,
/// or NaN, too. A pass of the operations that compare neighbouring depths. Around the image lie invalid pixels, three on
/// every side, so that their kernels need not ask where it ends.
Image inverse_depth(runtime::Scratch& scratch, const StoredDepth& stored, Background background = Background::inf);

/// An image for it, which the invalid pixels lie around.
Image image_of_inverse_depth(runtime::Scratch& scratch, int width, int height);

/// Bytes of such an image.
std::size_t inverse_depth_bytes(int width, int height);

/// An operation that takes nothing but inverse depth, and looks `reach` rows around a pixel: calls `run` with the inverse depth of
/// some rows, the rows of the result that it is to make, and where they lie. The rows keep to the device's budget; without one
/// they are all of them.
/// Throws: Error that names the budget that `what` needs.
void over_inverse_depth(
    const StoredDepth& stored, Background background, int reach, std::string_view what, const Image& result,
    const std::function<void(const Image& depth, const Image& made, const params::grid_params& grid)>& run);

} // namespace fathom
