#pragma once

#include "camera/rays.hpp"

#include <fathom/image.hpp>

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

} // namespace fathom
