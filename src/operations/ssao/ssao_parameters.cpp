// Constants of the kernels of ssao, and how the planes lie that they share.

#include "operations/ssao/ssao_parameters.hpp"

#include "operations/parameters.hpp"
#include "operations/ssao/ssao_method.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace fathom {
namespace {

// Widths of a pixel that a neighbour may lie off the tangent plane and still be of the same surface.
constexpr float filter_edge = 0.5f;

} // namespace

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
    p.edge = filter_edge;
    p.slices = to_u32(table.slices);
    p.levels = to_u32(table.levels);
    return p;
}

params::grid_params lattice_grid(const Image& source, const PixelLattice& lattice, int top) {
    const std::size_t first = static_cast<std::size_t>(lattice.y - top) * source.row_stride() +
                              static_cast<std::size_t>(lattice.x * source.channels());
    return {.source_offset = source.offset() + first,
            .target_offset = 0,
            .source_stride = to_u32(source.row_stride()) * to_u32(lattice.every),
            .target_stride = 0,
            .x_begin = 0,
            .x_end = to_u32(lattice.width),
            .height = to_u32(lattice.height),
            .pixel_x = to_u32(lattice.camera_x),
            .pixel_y = to_u32(lattice.camera_y),
            .y_begin = 0};
}

} // namespace fathom
