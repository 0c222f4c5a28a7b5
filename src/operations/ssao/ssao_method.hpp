#pragma once

#include "camera/rays.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/ssao/slices.hpp"
#include "params.h"

#include <fathom/image.hpp>
#include <fathom/ssao.hpp>

#include <variant>
#include <vector>

namespace fathom {

/// The pixels that occlusion is computed for: all of an image, or every second one of every second row of the camera's.
struct PixelLattice {
    int every;              ///< pixel of a row and row: 1 or 2
    int x, y;               ///< the first of them in the image
    int width, height;      ///< how many there are
    int camera_x, camera_y; ///< the first of them, counted among the camera's
};

PixelLattice pixel_lattice(const Tile& tile, int every = 1);

/// The same rays, by the lattice's columns and rows.
CentreRays rays_of(const CentreRays& rays, const PixelLattice& lattice);

/// The thickness that the options give in this way, if they do.
template <typename Way>
const Way* thickness_as(const SsaoOptions& options) {
    return options.thickness ? std::get_if<Way>(&*options.thickness) : nullptr;
}

inline bool has_silhouettes(const SsaoOptions& options) {
    return !options.thickness || thickness_as<Silhouette>(options);
}

/// Of options whose tolerance has become a method.
inline const Sampling& sampling_of(const SsaoOptions& options) {
    return std::get<Sampling>(options.sampling);
}

inline bool is_half(const SsaoOptions& options) {
    return sampling_of(options).half_resolution.value_or(false);
}

/// By quality, or as the sampling says.
Counts counts_of(const Sampling& sampling);

/// How a quality chooses blocks of half resolution, and what it samples there. docs/research.md has the
/// measurements.
struct HalfResolution {
    int slices, samples, jitter;
    double growth;
    double least_px;       ///< radius on every surface of such a block, pixels
    double least_rough_px; ///< the same where there are low steps or thin objects: kernels/ssao/ssao_blocks.cl
};
const HalfResolution& half_of(Quality quality);

/// Is every block computed at half resolution or at all pixels? What the presets do: a quality alone, and an image that has even
/// columns and rows.
bool chooses_blocks(const Tile& tile, const SsaoOptions& options);

/// Those for the blocks at half resolution.
SsaoOptions half_options(const SsaoOptions& options);

/// The steps from pixel to pixel of the passes: 1 for all pixels, 2 for half resolution.
std::vector<int> passes_of(const Tile& tile, const SsaoOptions& options);

/// How many kinds of sums there are.
int sums_of(const SsaoOptions& options);

/// Do slopes come from fitted normals? They do if differences of neighbours show mostly the storage's steps, and none are given.
bool fits_normals(const Tile& tile, const SsaoOptions& options);

/// Are they the slopes of the tangent planes instead, packed into one word as in kernels/ssao/split.h? A face of a lens has them.
bool has_slopes(const SsaoOptions& options);

Region region_of(const StoredDepth& stored, const SsaoOptions& options);

/// How far a slope from the difference of two neighbours may be off, in errors of inverse depth.
inline constexpr float slope_errors_neighbours = 2;

/// Lengths are squared in floats. Every visible surface is nearer than this.
inline constexpr double longest_length = 1e18;

/// How the pixels lie when split into planes of one jitter pattern each. Pure: no device.
params::split_params split_parameters(const PixelLattice& lattice);

/// Constants of the occlusion kernels, but for `slope_errors`. Of the table only its counts are used. Pure: no device.
params::occlusion_params occlusion_parameters(const Camera& camera, const CentreRays& rays,
                                              const InverseDepthError& error, double radius, const SsaoOptions& options,
                                              const SliceTable& table);

/// Where the pixels of a lattice lie in an image that begins with row `top` of the stored one. The offset of the first pixel
/// wraps if the image does not have its row.
params::grid_params lattice_grid(const Image& source, const PixelLattice& lattice, int top = 0);

} // namespace fathom
