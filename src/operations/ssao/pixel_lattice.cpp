// The pixels of an image that an operation works from: all, or every second one of every second row of the camera's image.

#include "operations/ssao/pixel_lattice.hpp"

namespace fathom {

PixelLattice pixel_lattice(const StoredDepth& stored, int every) {
    const int x = stored.x % every, y = stored.y % every; // of two, the even ones
    return {.every = every,
            .x = x,
            .y = y,
            .width = (stored.image.width() - x + every - 1) / every,
            .height = (stored.image.height() - y + every - 1) / every,
            .camera_x = (stored.x + x) / every,
            .camera_y = (stored.y + y) / every};
}

// Pixel i of the lattice is pixel `every` i of the camera, so i + 1/2 stands for every (i + 1/2) + (1 - every) / 2.
CentreRays rays_of(const CentreRays& rays, const PixelLattice& lattice) {
    Rays::Matrix pixel = Rays::Matrix::Identity();
    pixel(0, 0) = pixel(1, 1) = lattice.every;
    pixel(0, 2) = pixel(1, 2) = 0.5L * (1 - lattice.every);
    CentreRays result = rays;
    result.origin = rays.origin * pixel;
    result.direction = rays.direction * pixel;
    result.depth = rays.depth * pixel;
    return result;
}

} // namespace fathom
