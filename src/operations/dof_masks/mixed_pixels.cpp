// Pixels between two surfaces: kernels/camera/inverse_depth.cl, then kernels/dof_masks/mixed_pixels.cl.

#include "operations/dof_masks/mixed_pixels.hpp"

#include "camera/rays.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/parameters.hpp"
#include "runtime/scratch.hpp"

#include <fathom/dof_masks.hpp>

#include <cmath>

namespace fathom {

void mixed_pixels(const StoredDepth& stored, const Image& result) {
    const Device& device = stored.image.device();
    const int width = result.width();
    const CentreRays rays = centre_rays(camera_rays(stored.camera));
    const InverseDepthError error = inverse_depth_error(stored.camera, stored.storage);
    // A pixel's width is a fraction of its distance under a perspective, and 1/z changes by the fraction that z changes by.
    const auto& moving = rays.perspective ? rays.direction : rays.origin;
    const auto least = static_cast<float>(mixed_pixels_min_widths * std::sqrt(moving.leftCols<2>().squaredNorm() / 2));
    const int vector_width = vector_width_for(device, width);
    runtime::Kernel& kernel =
        runtime::kernel(device, "mixed_pixels", {{"V", vector_width}, {"STREAM", 0}, {"CHANNELS", result.channels()}});
    const params::mixed_params parameters{error.constant,
                                          error.linear,
                                          error.quadratic,
                                          rays.perspective ? 0 : least,
                                          rays.perspective ? least : 0,
                                          static_cast<float>(mixed_pixels_min_step)};
    // Where the far plane is finite its depth is averaged like any other.
    over_inverse_depth(stored, Background::decode, mixed_pixels_reach, "mixed_pixels", result,
                       [&](const Image& depth, const Image& made, const params::grid_params& grid) {
                           runtime::launch(device, kernel, range_of(width, made.height(), vector_width), depth, made,
                                           grid, parameters);
                       });
}

} // namespace fathom
