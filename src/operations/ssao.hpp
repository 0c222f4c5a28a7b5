#pragma once

#include "camera/eye_rays.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/slices.hpp"
#include "params.h"

#include <fathom/ssao.hpp>

namespace fathom {

/// What a slope may be off by, in errors of inverse depth: one neighbour's difference.
inline constexpr float slope_errors_neighbours = 2;

/// The pixels that are looked at from: all of an image, or every second one of every second row of the camera's.
struct PixelLattice {
    int every;              ///< pixel of a row and row: 1 or 2
    int x, y;               ///< the first of them in the image
    int width, height;      ///< how many there are
    int camera_x, camera_y; ///< the first of them, counted among the camera's
};

PixelLattice pixel_lattice(const StoredDepth& stored, int every = 1);

/// The same rays, by the lattice's columns and rows.
EyeRays rays_of(const EyeRays& eye, const PixelLattice& lattice);

/// How the pixels lie when split into planes of one sampling pattern each. Pure: no device.
params::split_params split_parameters(const PixelLattice& lattice);

/// Constants of the occlusion kernels, but for `slope_errors`. Of the table only its counts are used. Pure: no device.
params::occlusion_params occlusion_parameters(const Camera& camera, const EyeRays& eye, const InverseDepthError& error,
                                              double radius, const SsaoOptions& options, const SliceTable& table);

} // namespace fathom
