#pragma once

#include "lens/camera_lens.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace fathom::lens {

/// Sides of the tiles that an image is cut into, in pixels: 1 << tile_shift.
inline constexpr int tile_shift = 4;

/// A patch is within this of the ray. Where depth counts along the view axis, of the ray's part along it, down to that of
/// `steepest_angle_deg`.
inline constexpr double patch_error = 0.25 * 0x1p-24;
inline constexpr double patch_slope_error = 1e-5; ///< of the derivatives by pixels, relative

/// Beyond this angle from the axis a depth along it says nothing of where a pixel's surface lies.
inline constexpr double steepest_angle_deg = 89;
double least_ahead(); ///< its cosine

/// A ray of view space with its derivatives by the steps of a patch, rounded to 40 bits so that hosts whose sines differ in their
/// last bits agree.
using PatchNode = std::array<Eigen::Vector3d, 4>; ///< u, h u_x, h u_y, h² u_xy

/// The rays of an image as bicubic Hermite patches of h × h pixels, h a power of two that the tile chooses, with nodes in the
/// centres of pixels. With h = 1 there is a node for each pixel and nothing between them. A node is NaN where there is no ray, and
/// so are the pixels of its patches.
struct Patches {
    int tiles_across = 0;
    std::vector<std::uint32_t> tiles; ///< by rows: 8 times the first node, and h = 1 << the lowest three bits
    std::vector<PatchNode> nodes;

    /// u, u_x and u_y at a position that is counted in pixels from the centre of the first one.
    std::array<Eigen::Vector3d, 3> at(double x, double y) const;
};

/// `along_axis`: does depth count along the view axis?
Patches patches_of(const CameraLens& lens, int width, int height, bool along_axis);

/// What kernels/camera/patch.h reads of the nodes: 20 floats each. `turn`: from the axes of view space to those of the result.
std::vector<float> patch_floats(const Patches& patches, const CameraLens& lens, const Eigen::Matrix3d& turn);

} // namespace fathom::lens
