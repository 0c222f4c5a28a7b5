// The pixels of an image that an operation works from: all, or every second one of every second row of the camera's image.

#include "operations/ssao/pixel_lattice.hpp"

namespace fathom {

PixelLattice pixel_lattice(const Tile& tile, int every) {
    const Region& pixels = tile.pixels;
    const int x = pixels.x % every, y = pixels.y % every; // of two, the even ones
    return {.every = every,
            .x = x,
            .y = y,
            .width = (pixels.width - x + every - 1) / every,
            .height = (pixels.height - y + every - 1) / every,
            .camera_x = (pixels.x + x) / every,
            .camera_y = (pixels.y + y) / every};
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
