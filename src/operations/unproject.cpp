// Positions from stored depth: one pass of kernels/camera/unproject.cl.

#include <fathom/unproject.hpp>

#include "camera/rays.hpp"
#include "description/check.hpp"
#include "description/unproject.hpp"
#include "operations/dof_masks/mixed_pixels.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/lens_table.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/launched.hpp"

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

void unproject_through_lens(const StoredDepth& stored, const Image& result, const UnprojectOptions& options,
                            const Launch& launch) {
    Rays axes;
    axes.direction.setIdentity(); // as if the axes of view space were rays, from the camera centre
    const Rays turned = target_of(axes, stored, options);
    const Device& device = stored.image.device();
    const int width = result.width(), vector_width = vector_width_for(device, width);
    ThroughLens lens(stored, turned.direction.cast<double>(), turned.origin.col(2).cast<double>(), vector_width,
                     worth_streaming(result, vector_width));
    lens.defines.emplace_back("CHANNELS", options.channels);
    const runtime::Launched launched(device, launch);
    runtime::launch(device, runtime::kernel(device, "lens_unproject", lens.defines),
                    range_of(width, result.height(), vector_width), stored.image, result, lens.table->tiles.on(device),
                    lens.table->nodes.on(device), grid_parameters(stored, result, 0, width),
                    depth_parameters(lens.form, stored.storage, options.background, device.options().arithmetic),
                    lens.parameters);
    launched.done();
}

} // namespace

void unproject(const StoredDepth& stored, const Image& result, const UnprojectOptions& options, const Launch& launch) {
    check(stored, options);
    check_result(stored, result, options.channels);
    if (stored.camera.lens)
        return unproject_through_lens(stored, result, options, launch);
    const Device& device = stored.image.device();
    const Arithmetic arithmetic = device.options().arithmetic;
    const DepthForm form = depth_form(stored.camera, stored.storage);
    const Rays view = camera_rays(stored.camera);
    const Rays target = target_of(view, stored, options);

    const runtime::Launched launched(device, launch);
    const int width = result.width();
    const int vector_width = vector_width_for(device, width);
    auto defines = decoder_defines(form, view, stored.storage, vector_width, worth_streaming(result, vector_width));
    defines.emplace_back("CHANNELS", options.channels);
    runtime::launch(device, runtime::kernel(device, "unproject", defines),
                    range_of(width, result.height(), vector_width), stored.image, result,
                    grid_parameters(stored, result, 0, width),
                    depth_parameters(form, stored.storage, options.background, arithmetic),
                    ray_parameters(view, arithmetic), ray_parameters(target, arithmetic));
    if (options.no_mixed_pixels)
        mixed_pixels(stored, result);
    launched.done();
}

Image unproject(const StoredDepth& stored, const UnprojectOptions& options, const Launch& launch) {
    check(stored, options);
    const Image result(stored.image.device(), Element::f32,
                       {stored.image.width(), stored.image.height(), options.channels});
    unproject(stored, result, options, launch);
    return result;
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
