#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>

#include <Eigen/Core>

namespace fathom {
#pragma GCC visibility push(default)

struct UnprojectOptions {
    Space space = Space::view;
    Eigen::Vector3d origin =
        Eigen::Vector3d::Zero();             ///< world: positions are relative to this point, which keeps floats exact
    int channels = 3;                        ///< 3 or 4, with w = 1 (0 for invalid and background pixels)
    Background background = Background::inf; ///< inf and nan: no position (NaN); decode: on the far plane
    bool no_mixed_pixels = false; ///< have pixels no position whose depth was averaged over an edge? See `DofMasks`
};

/// Positions are within this of the exact ones, relative to the distance from the camera centre (plus, in world space, the
/// centre's distance from `origin`): four rounding errors.
inline constexpr double unproject_relative_error = 4 * 0x1p-24;

/// View- or world-space positions from stored depth (or from view depth, through `ViewDepth::stored`), in one pass.
///
/// In: one stored value a pixel. Out: x, y, z (and w) interleaved floats in the projection's axes or in the world's,
/// scene units. Invalid and background pixels have NaN in x, y, z. Mixed pixels are looked for in a pass of its own, which sees no
/// farther than the given image and takes 4 bytes a pixel.
/// Accuracy: `unproject_relative_error`, plus the condition term of `linearize`;
/// `inexact::unproject_ulp` more on a device that is not exact (probe.hpp).
/// Throws: std::invalid_argument for options out of range, and for world space without a view matrix.
/// Source: Lenaerts 2014, reconstructing positions from the depth buffer, part 2; rays as derived in docs/camera.md.
Image unproject(const StoredDepth& stored, const UnprojectOptions& options = {}, const Launch& launch = {});

/// The same into an image of the caller's: `options.channels` floats a pixel, the size of the depth, with any row stride.
/// It shares no memory with the depth.
void unproject(const StoredDepth& stored, const Image& result, const UnprojectOptions& options = {},
               const Launch& launch = {});

/// Without mixed pixels a position depends on two pixels on either side, and a call takes memory of its own; see tiles.hpp.
Reach reach(const Tile& tile, const UnprojectOptions& options);
std::size_t bytes(const Tile& tile, const UnprojectOptions& options);

#pragma GCC visibility pop
} // namespace fathom
