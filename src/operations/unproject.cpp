// Positions from stored depth: one pass of kernels/camera/unproject.cl.

#include <fathom/unproject.hpp>

#include "camera/form.hpp"
#include "camera/rays.hpp"
#include "description/check.hpp"
#include "description/unproject.hpp"
#include "operations/dof_masks/dof_masks.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/lens_table.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/launch.hpp"

namespace fathom {
namespace {

void check(const StoredDepth& stored, const UnprojectOptions& options) {
    check_stored(stored);
    describe(description::Check{}, options);
    require(options.space == Space::view || stored.camera.view,
            "positions in the world need the camera's view matrix, and it has none");
    require(!options.no_mixed_pixels || !stored.camera.lens,
            "no_mixed_pixels looks along straight lines, and the camera has a lens, which bends them; leave it out");
}

// In the axes of the result.
Rays target_of(const Rays& view, const StoredDepth& stored, const UnprojectOptions& options) {
    return options.space == Space::world ? rays_in_world(view, *stored.camera.view, options.origin) : view;
}

LensAxes axes_of(const StoredDepth& stored, const UnprojectOptions& options) {
    if (!stored.camera.lens)
        return {};
    const Rays turned = target_of(axes_of_view(), stored, options);
    return {turned.direction.cast<double>(), turned.origin.col(2).cast<double>()};
}

} // namespace

void unproject(const StoredDepth& stored, const Image& result, const UnprojectOptions& options, const Launch& launch) {
    check(stored, options);
    check_result(stored, result, options.channels);
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(straightened(stored.camera), stored.storage);
    const Rays view = straight_rays(stored.camera);
    const Rays target = target_of(view, stored, options);
    const KernelLens lens(device, stored.camera, axes_of(stored, options));

    const runtime::Launched launched(device, launch);
    const int width = result.width();
    const int vector_width = vector_width_for(device, width);
    auto defines = lens.with_lens(
        decoder_defines(form, view, stored.storage, vector_width, worth_streaming(result, vector_width)));
    defines.emplace_back("CHANNELS", options.channels);
    lens.launch(device, runtime::kernel(device, "unproject", defines), range_of(width, result.height(), vector_width),
                stored.image, result, grid_parameters(stored, result, 0, width),
                depth_parameters(form, stored.storage, options.background, arithmetic),
                ray_parameters(view, arithmetic), ray_parameters(target, arithmetic));
    if (options.no_mixed_pixels)
        mixed_pixels(stored, result);
    launched.done();
}

Image unproject(const StoredDepth& stored, const UnprojectOptions& options, const Launch& launch) {
    check(stored, options);
    return run_into_new_images(description::UnprojectCall{.options = options}, stored, launch).result;
}

Reach reach(const Tile&, const UnprojectOptions& options) {
    describe(description::Check{}, options);
    return options.no_mixed_pixels ? Reach{mixed_pixels_reach, mixed_pixels_reach} : Reach{};
}

std::size_t bytes(const Tile& tile, const UnprojectOptions& options) {
    describe(description::Check{}, options);
    return options.no_mixed_pixels ? inverse_depth_bytes(tile.pixels.width, tile.pixels.height) : 0;
}

} // namespace fathom
