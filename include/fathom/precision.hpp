#pragma once

#include <fathom/camera.hpp>

#include <Eigen/Core>

namespace fathom {
#pragma GCC visibility push(default)

/// Buffers that a stored depth may come from.
enum class DepthBits { d16, d24, d32f };

/// The storage whose steps such a buffer has.
Storage storage_of(DepthBits bits);

/// Distance along the view axis between the two stored values that enclose depth `z` at pixel position (x, y):
/// no two surfaces nearer to each other than this can be told apart. Scene units.
/// Source: none is needed: for any form it is |dz/dv| times the step of the stored value.
double depth_spacing(const Camera& camera, DepthBits bits, double x, double y, double z);

/// Bound of z's error that storing it caused: half the spacing, the larger of the two sides.
double depth_error_bound(const Camera& camera, DepthBits bits, double x, double y, double z);

/// Greatest distance along the view axis at which a surface can still be stored in the direction of pixel (x, y):
/// where the ray leaves through the far plane, tilted or not; infinity when it never does.
/// Source: the far plane of Lengyel 2005, eq. 8; equally his eq. 18, solved for the depth that is stored as far.
double attainable_depth(const Camera& camera, double x, double y);

/// How far `pseudo_linear` depth can be off inside a triangle whose vertices lie at depths from `nearest` to `farthest`:
/// the largest difference between the decoded and the true view depth, scene units.
///   (sqrt(farthest) − sqrt(nearest))²
/// The stored value interpolates linearly in the window while 1/z does; the difference is largest where the true depth
/// is the geometric mean. Throws: std::invalid_argument unless 0 < nearest ≤ farthest.
/// Source: the finding is Goldberg's (z·w is not linear depth), the bound follows from the two interpolations.
double pseudo_linear_bound(double nearest, double farthest);

#pragma GCC visibility pop
} // namespace fathom
