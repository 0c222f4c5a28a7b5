#pragma once

#include "operations/ssao/pixel_lattice.hpp"
#include "params.h"
#include "runtime/scratch.hpp"

#include <fathom/image.hpp>

namespace fathom {

/// Of the radius and the rays that the occlusion kernels have. Pure: no device.
params::silhouette_params silhouette_parameters(const params::occlusion_params& occlusion);

/// How thick what each pixel of the lattice shows is taken to be, from the width of its silhouette: one float, scene units.
/// `depth`: inverse depth with its margins. What is no surface has some thickness, too.
Image silhouette_thickness(runtime::Scratch& scratch, const Image& depth, const PixelLattice& lattice, bool perspective,
                           const params::occlusion_params& occlusion);

} // namespace fathom
