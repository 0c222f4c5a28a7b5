// Thickness from the silhouette's width: one pass of kernels/ssao/silhouette.cl.

#include "operations/ssao/silhouette.hpp"

#include "operations/parameters.hpp"
#include "operations/ssao/ssao_parameters.hpp"

#include <fathom/ssao.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <iterator>

namespace fathom {

params::silhouette_params silhouette_parameters(const params::occlusion_params& occlusion) {
    const auto step = [&](int i) {
        return Eigen::Vector3f(occlusion.step[0][i], occlusion.step[1][i], occlusion.step[2][i]);
    };
    const Eigen::Vector3f steps[] = {step(0), step(1), step(0) + step(1), step(0) - step(1)};
    params::silhouette_params p{};
    std::ranges::transform(steps, std::begin(p.step), [](const Eigen::Vector3f& each) { return each.norm(); });
    p.least_step = *std::ranges::min_element(p.step);
    p.least = static_cast<float>(silhouette_least) * occlusion.radius;
    p.most = static_cast<float>(silhouette_most) * occlusion.radius;
    p.farther = static_cast<float>(silhouette_step) * occlusion.radius;
    return p;
}

Image silhouette_thickness(runtime::Scratch& scratch, const Image& depth, const PixelLattice& lattice, bool perspective,
                           const params::occlusion_params& occlusion) {
    const Device& device = depth.device();
    constexpr int lanes = params::split_margin; // of the last vector of a row, all have a place
    const Image result = scratch.image(Element::f32, {(lattice.width + lanes - 1) / lanes * lanes, lattice.height})
                             .region(0, 0, lattice.width, lattice.height);
    params::grid_params grid = lattice_grid(depth, lattice);
    grid.target_offset = result.offset();
    grid.target_stride = to_u32(result.row_stride());
    const int vector_width = device.options().vector_width;
    runtime::launch(
        device,
        runtime::kernel(device, "silhouette",
                        {{"EVERY", lattice.every}, {"V", vector_width}, {"STREAM", 0}, {"PERSPECTIVE", perspective}}),
        range_of(lattice.width, lattice.height, vector_width), depth, result, grid, occlusion,
        silhouette_parameters(occlusion));
    return result;
}

} // namespace fathom
