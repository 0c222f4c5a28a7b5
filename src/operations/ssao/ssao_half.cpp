// Where ssao is computed: at all pixels, for every second pixel of every second row before joint upsampling, or block by block.

#include "operations/inverse_depth.hpp"
#include "operations/parameters.hpp"
#include "operations/ssao/ssao_call.hpp"
#include "operations/ssao/ssao_method.hpp"

#include <fathom/ssao.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <iterator>
#include <limits>
#include <vector>

namespace fathom {
namespace {

// A block at half resolution needs results so many pixels beyond it: a seam, one more to interpolate, and the filter.
constexpr params::u32 half_margin = 16;

// A kernel of the program of all of them, which those that have no output take from the first one's.
runtime::Kernel& of_half_resolution(const Call& call, const char* name, Output output = Output::visibility) {
    return call.kernel(name, {{"OUTPUT", static_cast<int>(output)}}, "half_resolution");
}

void upsample(const Call& call, const Image& depth, const Image& found, Output output, const Image& result,
              const Region& region) {
    const PixelLattice all = pixel_lattice(call.stored);
    const std::size_t wide = 2 * static_cast<std::size_t>(call.device.options().vector_width); // of a work-item
    const std::size_t columns = static_cast<std::size_t>(all.width) + static_cast<std::size_t>(call.stored.x) % wide;
    constexpr int halo = params::depth_margin_rows;
    for (const Band& band : depth_bands(call, depth, region.height, halo, 1)) {
        runtime::Scratch scratch(call.device);
        const int first = std::max(region.y + band.begin - halo, 0),
                  last = std::min(region.y + band.end + halo, all.height);
        const DepthRows here = depth_of(call, scratch, depth, {0, first, all.width, last - first});
        const int rows = band.end - band.begin;
        const Image part = result.region(0, band.begin, region.width, rows);
        runtime::launch(call.device, of_half_resolution(call, "joint_upsample", output),
                        {(columns + wide - 1) / wide, static_cast<std::size_t>(rows)}, here.image, found, call.blocks,
                        part, lattice_grid(here.image, all, here.top),
                        lattice_grid(found, pixel_lattice(StoredDepth{found, call.stored.camera})),
                        result_grid(part, {region.x, region.y + band.begin, region.width, rows}), call.work,
                        call.parameters(all));
    }
}

// All pixels of a region that the call works for.
void whole_resolution(Call& call, const Image& depth, const std::vector<Wanted>& results) {
    const Planes planes = split_into_planes(call, depth);
    add_up(call, planes, results, region_of(call.stored, call.options));
}

// That of a face, where this is all of it.
Image depth_on_face(const Call& call) {
    const OnFace* face = call.workspace.face;
    return face && face->depth.height() == call.stored.image.height() ? face->depth : Image();
}

Image shared_depth(Call& call) {
    const Image& image = call.stored.image;
    if (const Image depth = depth_on_face(call))
        return depth;
    return shares_depth(image.width(), image.height(), call.options, call.workspace.bytes)
               ? inverse_depth(call.scratch, call.stored)
               : Image();
}

// Every second pixel of every second row, and those between.
void half_resolution(Call& call, const Image& depth, const std::vector<Wanted>& results) {
    const Planes planes = split_into_planes(call, depth);
    const Region region = region_of(call.stored, call.options);
    const int rows = call.lattice.height;
    // Rows that the region's pixels lie between, and one more for where it has an odd row alone.
    const int first = std::clamp((region.y - call.lattice.y) / 2 - 1, 0, rows - 1);
    const int last = std::clamp((region.y + region.height - call.lattice.y) / 2 + 2, first + 1, rows);
    const Region needed{0, first, call.lattice.width, last - first};
    std::vector<Wanted> found, halves;
    for (const Wanted& result : results) {
        const Layout layout{call.lattice.width, call.lattice.height, channels_of(result.output)};
        found.push_back({result.output, call.scratch.image(Element::f32, layout)});
        halves.push_back({result.output, found.back().image.region(0, first, layout.width, needed.height)});
    }
    add_up(call, planes, halves, needed);
    for (std::size_t i = 0; i < found.size(); ++i)
        upsample(call, depth, found[i].image, results[i].output, results[i].image, region);
}

// Normals that are given tell of faces a pixel wide, which would lie between the computed pixels.
bool keeps_rough_blocks(const SsaoOptions& options) {
    return options.normals && !has_slopes(options);
}

// Which blocks of the camera's image are computed at all pixels, see kernels/ssao/blocks.h.
WholeBlocks chosen_blocks(Call& call, const Image& depth, const HalfResolution& half) {
    const PixelLattice all = pixel_lattice(call.stored);
    const int x = call.stored.x >> params::ssao_block_shift, y = call.stored.y >> params::ssao_block_shift;
    const params::occlusion_params occlusion = call.parameters(all);
    constexpr float none = std::numeric_limits<float>::infinity();
    // A radius of that many pixels, as inverse depth; without perspective it has them everywhere or nowhere.
    const auto farthest = [&](double pixels) {
        const auto least = static_cast<float>(pixels) * occlusion.pixel / occlusion.radius;
        return call.rays.perspective ? least : least > 1 ? none : -none;
    };
    const params::block_params chosen{
        .first_column = x,
        .first_row = y,
        .columns = to_u32(((call.stored.x + all.width - 1) >> params::ssao_block_shift) - x + 1),
        .rows = to_u32(((call.stored.y + all.height - 1) >> params::ssao_block_shift) - y + 1),
        .every = 1,
        .wanted = 0,
        .margin = 0,
        .least = farthest(half.least_px),
        .least_rough = keeps_rough_blocks(call.options) && half.least_px < half.least_rough_px
                           ? none
                           : farthest(half.least_rough_px)};
    const Image blocks =
        call.scratch.image(Element::u32, {static_cast<int>(chosen.columns * chosen.rows) + 2, 1}); // and two kinds
    constexpr int size = 1 << params::ssao_block_shift, halo = 1;                                  // block
    const auto row = [&](int block) { return std::clamp(block * size - call.stored.y % size, 0, all.height); };
    for (const Band& band : depth_bands(call, depth, static_cast<int>(chosen.rows), halo, size)) {
        runtime::Scratch scratch(call.device);
        const DepthRows here =
            depth_of(call, scratch, depth, {0, row(band.first), all.width, row(band.last) - row(band.first)});
        params::grid_params from = lattice_grid(here.image, all, here.top);
        from.y_begin = to_u32(band.begin);
        runtime::launch(call.device, of_half_resolution(call, "ssao_blocks"),
                        {chosen.columns, static_cast<std::size_t>(band.end - band.begin)}, here.image, blocks, from,
                        chosen, occlusion);
    }
    if (const OnFace* face = call.workspace.face)
        runtime::launch(call.device, runtime::kernel(call.device, "face_blocks", {{"V", 1}, {"STREAM", 0}}), {1, 1},
                        face->blocks, blocks, chosen, params::face_block_params{to_u32(face->columns), 0});
    else
        runtime::launch(call.device, of_half_resolution(call, "ssao_kinds"), {1, 1}, blocks, chosen);
    return {blocks, chosen};
}

// Of the radius and the rays that the occlusion kernels have.
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

constexpr float followed_to_crease = 1.5f; ///< pixels

} // namespace

void occlude(Workspace& workspace, const StoredDepth& stored, double radius, const SsaoOptions& options,
             const std::vector<Wanted>& results) {
    const bool silhouettes = has_silhouettes(options);
    runtime::Scratch scratch(stored.image.device());
    SsaoOptions known = options;
    // The thickness is an image, from here on. A thickness that is given ends where it says, in creases as well.
    const auto measure_silhouettes = [&](const Call& call, const Image& depth, const WholeBlocks& blocks) {
        if (silhouettes)
            known.thickness =
                silhouette_thickness(scratch, depth, stored, call.rays.perspective,
                                     call.parameters(pixel_lattice(stored)), sampling_of(options), blocks);
    };
    const auto follow_to_creases = [&](Call& call) {
        if (silhouettes)
            call.occlusion.crease = followed_to_crease;
    };
    if (!chooses_blocks(stored, options)) {
        const bool half = is_half(options);
        Call call(stored, radius, known, workspace);
        const Image depth = half || silhouettes ? shared_depth(call) : depth_on_face(call);
        measure_silhouettes(call, depth, {});
        follow_to_creases(call);
        (half ? half_resolution : whole_resolution)(call, depth, results);
        return;
    }
    SsaoOptions few_options = half_options(options);
    Call few(stored, radius, few_options, workspace);
    const Image depth = shared_depth(few);
    const WholeBlocks blocks = chosen_blocks(few, depth, half_of(sampling_of(options).quality));
    measure_silhouettes(few, depth, blocks);
    few_options.thickness = known.thickness;
    {
        Call all(stored, radius, known, workspace);
        all.work_for(blocks.words, blocks.chosen, 1, 0);
        follow_to_creases(all);
        whole_resolution(all, depth, results);
    }
    few.work_for(blocks.words, blocks.chosen, 0, half_margin);
    follow_to_creases(few);
    half_resolution(few, depth, results);
}

// One pass of kernels/ssao/silhouette.cl.
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
