#pragma once

#include <fathom/normals.hpp>

namespace fathom {

/// The method, also where it is `automatic`.
NormalMethod chosen_method(const NormalsOptions& options, const Tile& tile);

/// How far the window of least squares reaches: from the noise and a pixel's angle, never from the image.
int window_radius(const Camera& camera, double noise);

} // namespace fathom
