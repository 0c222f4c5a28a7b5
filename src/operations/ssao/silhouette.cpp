// Thickness from the silhouette's width: one pass of kernels/ssao/silhouette.cl.

#include "operations/ssao/silhouette.hpp"

#include "operations/parameters.hpp"
#include "operations/ssao/ssao_parameters.hpp"

#include <fathom/ssao.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <iterator>
#include <vector>

namespace fathom {

params::silhouette_params silhouette_parameters(const params::occlusion_params& occlusion, Quality quality) {
    const auto step = [&](int i) {
        return Eigen::Vector3f(occlusion.step[0][i], occlusion.step[1][i], occlusion.step[2][i]);
    };
    const Eigen::Vector3f steps[] = {step(0), step(1), step(0) + step(1), step(0) - step(1)};
    params::silhouette_params p{};
    std::ranges::transform(steps, std::begin(p.step), [](const Eigen::Vector3f& each) { return each.norm(); });
    p.directions = quality == Quality::fast ? 2 : 4;
    p.least = static_cast<float>(silhouette_least) * occlusion.radius;
    p.most = static_cast<float>(silhouette_most) * occlusion.radius;
    p.farther = static_cast<float>(silhouette_step) * occlusion.radius;
    p.reach = p.most / *std::ranges::min_element(p.step);
    return p;
}

Image silhouette_thickness(runtime::Scratch& scratch, const Image& depth, const Tile& stored, bool perspective,
                           const params::occlusion_params& occlusion, const Sampling& sampling,
                           const WholeBlocks& blocks) {
    const Device& device = depth.device();
    const PixelLattice all = pixel_lattice(stored);
    constexpr int lanes = 2 * params::split_margin; // of the last vector of a row, all have a place
    const Image result = scratch.image(Element::f32, {(all.width + lanes) / lanes * lanes, all.height})
                             .region(0, 0, all.width, all.height);
    params::grid_params grid = lattice_grid(depth, all);
    grid.target_offset = result.offset();
    grid.target_stride = to_u32(result.row_stride());
    params::block_params whole = blocks.chosen;
    whole.wanted = 1;
    const Image words = blocks.words ? blocks.words : scratch.image(Element::u32, {1, 1});
    const int vector_width = device.options().vector_width;
    params::silhouette_params p = silhouette_parameters(occlusion, sampling.quality);
    const bool half = sampling.half_resolution.value_or(false);
    for (const int every : blocks.words ? std::vector{1, 2} : std::vector{half ? 2 : 1}) {
        const PixelLattice lattice = pixel_lattice(stored, every);
        p.first_x = to_u32(lattice.x);
        p.first_y = to_u32(lattice.y);
        runtime::launch(
            device,
            runtime::kernel(device, "silhouette",
                            {{"EVERY", every}, {"V", vector_width}, {"STREAM", 0}, {"PERSPECTIVE", perspective}}),
            range_of(lattice.width, lattice.height, vector_width), depth, words, result, grid, whole, occlusion, p);
    }
    return result;
}

} // namespace fathom
