#pragma once

#include "operations/ssao/pixel_lattice.hpp"
#include "params.h"
#include "runtime/scratch.hpp"

#include <fathom/image.hpp>
#include <fathom/ssao.hpp>
#include <fathom/tiles.hpp>

namespace fathom {

/// Of the radius and the rays that the occlusion kernels have. Pure: no device.
params::silhouette_params silhouette_parameters(const params::occlusion_params& occlusion, Quality quality);

/// The blocks of an image, if it has any, and those of them that are computed at all pixels.
struct WholeBlocks {
    Image words = {};
    params::block_params chosen{};
};

/// How thick what each pixel of the depth's image shows is taken to be, from the width of its silhouette: one float, scene units.
/// With half resolution, and where no block is computed at all pixels, it is that of every second pixel of every second row alone.
/// `depth`: inverse depth with its margins. What is no surface has some thickness, too.
Image silhouette_thickness(runtime::Scratch& scratch, const Image& depth, const Tile& stored, bool perspective,
                           const params::occlusion_params& occlusion, const Sampling& sampling,
                           const WholeBlocks& blocks);

} // namespace fathom
