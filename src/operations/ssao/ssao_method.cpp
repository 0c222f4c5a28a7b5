// What the options of ssao mean for its passes: pixels, slices, and constants of the kernels.

#include "operations/ssao/ssao_method.hpp"

#include "operations/parameters.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

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

Counts counts_of(const Sampling& sampling) {
    constexpr Counts of_quality[] = {{1, 6, 16, 1}, {1, 32, 16, 1}, {4, 30, 4, 2}};
    Counts chosen = of_quality[static_cast<int>(sampling.quality)];
    chosen.slices = sampling.slices.value_or(chosen.slices);
    chosen.samples = sampling.samples.value_or(chosen.samples);
    chosen.jitter = sampling.jitter.value_or(chosen.jitter);
    chosen.growth = sampling.growth.value_or(chosen.growth);
    return chosen;
}

const HalfResolution& half_of(Quality quality) {
    static constexpr HalfResolution of_quality[] = {
        {1, 22, 16, 2.3, 48, 48}, {2, 26, 16, 3, 128, 192}, {3, 66, 16, 2, 64, 192}};
    return of_quality[static_cast<int>(quality)];
}

bool chooses_blocks(const Tile& tile, const SsaoOptions& options) {
    const PixelLattice half = pixel_lattice(tile, 2);
    const Sampling& sampling = sampling_of(options);
    return !sampling.half_resolution && !sampling.slices && !sampling.samples && !sampling.growth && !sampling.jitter &&
           half.width > 0 && half.height > 0;
}

SsaoOptions half_options(const SsaoOptions& options) {
    SsaoOptions few = options;
    Sampling& sampling = std::get<Sampling>(few.sampling);
    sampling.half_resolution = true;
    const HalfResolution& half = half_of(sampling.quality);
    sampling.slices = half.slices;
    sampling.samples = half.samples;
    sampling.jitter = half.jitter;
    sampling.growth = half.growth;
    return few;
}

std::vector<int> passes_of(const Tile& tile, const SsaoOptions& options) {
    if (chooses_blocks(tile, options))
        return {1, 2};
    return {is_half(options) ? 2 : 1};
}

int sums_of(const SsaoOptions& options) {
    return options.bent_normal ? 6 : options.confidence ? 3 : 2;
}

bool fits_normals(const Tile& tile, const SsaoOptions& options) {
    return !options.normals && (options.tolerance > 1 || is_coarse(tile));
}

bool has_slopes(const SsaoOptions& options) {
    return options.normals && options.normals.channels() == 1;
}

Region region_of(const StoredDepth& stored, const SsaoOptions& options) {
    return options.region.value_or(Region{0, 0, stored.image.width(), stored.image.height()});
}

// Constants of the kernels of ssao, and how the planes lie that they share.

params::split_params split_parameters(const PixelLattice& lattice) {
    const int columns = ((lattice.width + (lattice.camera_x & 3) + 3) / 4 + 15) / 16 * 16;
    const int rows = (lattice.height + (lattice.camera_y & 3) + 3) / 4;
    // Rows and planes begin an odd number of cache lines apart. By powers of two they would share few places in the cache.
    constexpr int line = 16;
    const int plane = (columns + 2 * params::split_margin) / line % 2 == 1 ? columns + 2 * params::split_margin
                                                                           : columns + 2 * params::split_margin + line;
    return {to_u32(lattice.width),
            to_u32(lattice.height),
            to_u32(lattice.camera_x),
            to_u32(lattice.camera_y),
            to_u32(columns),
            to_u32(rows),
            to_u32(params::split_planes * plane + line),
            to_u32(plane)};
}

params::occlusion_params occlusion_parameters(const Camera& camera, const CentreRays& rays,
                                              const InverseDepthError& error, double radius, const SsaoOptions& options,
                                              const SliceTable& table) {
    params::occlusion_params p{};
    const Rays::Matrix& moving = rays.perspective ? rays.direction : rays.origin;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            p.direction[i][j] = static_cast<float>(rays.direction(i, j));
        for (int j = 0; j < 2; ++j)
            p.step[i][j] = static_cast<float>(moving(i, j));
    }
    const bool world = options.normals && options.normals_space == Space::world;
    const Eigen::Matrix3d turn =
        world ? Eigen::Matrix3d(camera.view->topLeftCorner<3, 3>().inverse().transpose()) : Eigen::Matrix3d::Identity();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            p.normals[i][j] = static_cast<float>(turn(i, j));
    }
    p.radius = static_cast<float>(std::min(radius, longest_length));
    const auto* thickness = thickness_as<double>(options);
    p.thickness = static_cast<float>(std::min(thickness ? *thickness : radius / 4, longest_length));
    const auto times = static_cast<float>(options.tolerance);
    p.error_constant = error.constant * times;
    p.error_linear = error.linear * times;
    p.error_quadratic = error.quadratic * times;
    p.pixel = static_cast<float>(std::sqrt(moving.leftCols<2>().squaredNorm() / 2));
    p.edge = 0.5f; // widths of a pixel that a neighbour may lie off the tangent plane and still be of the same surface
    p.slices = to_u32(table.slices);
    p.levels = to_u32(table.levels);
    return p;
}

params::grid_params lattice_grid(const Image& source, const PixelLattice& lattice, int top) {
    params::grid_params grid = grid_parameters(source, Image(), 0, lattice.width, lattice.camera_x, lattice.camera_y);
    grid.source_offset += static_cast<std::size_t>(lattice.y - top) * source.row_stride() +
                          static_cast<std::size_t>(lattice.x * source.channels());
    grid.source_stride *= to_u32(lattice.every);
    grid.height = to_u32(lattice.height);
    return grid;
}

} // namespace fathom
