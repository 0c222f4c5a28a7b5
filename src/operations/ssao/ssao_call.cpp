// What the passes of ssao share: constants, tables, and rows of inverse depth.

#include "operations/ssao/ssao_call.hpp"

#include "operations/inverse_depth.hpp"
#include "operations/parameters.hpp"
#include "runtime/kept.hpp"

#include <algorithm>
#include <bit>

namespace fathom {
namespace {

// What a slice table is made from.
struct SliceKey {
    std::uint64_t growth, falloff; // the bits of doubles
    int slices, samples, largest_radius, jitter;
    std::uint32_t seed;
    PlaneLayout place;
    std::uint32_t reserved = 0;
};

std::shared_ptr<const DeviceSlices> slices_on(const Device& device, const SliceKey& key) {
    return runtime::kept<DeviceSlices>(device, key, [&] {
        const SliceTable table =
            slice_table({key.slices, key.samples, key.jitter, std::bit_cast<double>(key.growth)}, key.largest_radius,
                        std::bit_cast<double>(key.falloff), key.seed, key.place);
        return std::make_shared<const DeviceSlices>(
            DeviceSlices{{table.slices, table.samples, table.levels, {}, {}, {}},
                         runtime::table(device, Element::f32, table.taps),
                         runtime::table(device, Element::f32, table.turns),
                         runtime::table(device, Element::u32, table.counts)});
    });
}

} // namespace

bool shares_depth(int width, int height, const SsaoOptions& options, const PassBytes& bytes) {
    return has_silhouettes(options) ||
           sizeof(float) * static_cast<std::size_t>(width) * static_cast<std::size_t>(height) <= bytes.shared;
}

std::size_t rows_of_sums(std::size_t all, std::size_t row_bytes, const PassBytes& bytes) {
    return std::min(std::bit_ceil(all), std::max(std::bit_floor(bytes.band / row_bytes), std::size_t{4}));
}

int longest_side_of(const Tile& tile, int every) {
    const PixelLattice lattice = pixel_lattice(tile, every);
    return std::max(lattice.width, lattice.height);
}

Call::Call(const StoredDepth& depth, double length, const SsaoOptions& asked, Workspace& shared)
    : workspace(shared), stored(depth), radius(length), options(asked), device(depth.image.device()),
      rays(centre_rays(camera_rays(depth.camera))), lattice(pixel_lattice(depth, is_half(asked) ? 2 : 1)),
      split(split_parameters(lattice)), chosen(counts_of(sampling_of(asked))),
      table(slices_on(device, {std::bit_cast<std::uint64_t>(chosen.growth),
                               std::bit_cast<std::uint64_t>(asked.falloff),
                               chosen.slices,
                               chosen.samples,
                               longest_side_of(workspace.whole, lattice.every),
                               chosen.jitter,
                               asked.seed,
                               {static_cast<int>(split.stride), static_cast<int>(split.plane)}})),
      occlusion(parameters(lattice)), scratch(device), blocks(table->counts.on(device)) {}

params::occlusion_params Call::parameters(const PixelLattice& pixels) const {
    return occlusion_parameters(stored.camera, rays_of(rays, pixels),
                                workspace.face ? workspace.face->error
                                               : inverse_depth_error(stored.camera, stored.storage),
                                radius, options, table->sizes);
}

runtime::Kernel& Call::kernel(const char* name, runtime::Defines defines, const char* program) const {
    defines.insert(defines.end(),
                   {{"V", device.options().vector_width}, {"STREAM", 0}, {"PERSPECTIVE", rays.perspective}});
    return runtime::kernel(device, name, defines, program);
}

std::size_t Call::vectors(params::u32 columns) const {
    return columns / static_cast<std::size_t>(device.options().vector_width);
}

void Call::work_for(const Image& words, params::block_params chosen, params::u32 wanted, params::u32 margin) {
    blocks = words;
    work = chosen;
    work.every = to_u32(lattice.every);
    work.wanted = wanted;
    work.margin = margin;
}

StoredDepth part_of(const StoredDepth& stored, const Region& rows) {
    return stored.region(rows.x, rows.y, rows.width, rows.height);
}

DepthRows depth_of(const Call& call, runtime::Scratch& scratch, const Image& whole, const Region& rows) {
    return whole ? DepthRows{whole, 0} : DepthRows{inverse_depth(scratch, part_of(call.stored, rows)), rows.y};
}

std::vector<Band> depth_bands(const Call& call, const Image& whole, int count, int halo, int rows_each) {
    const std::size_t row_bytes =
        sizeof(float) * static_cast<std::size_t>(call.stored.image.width()) * static_cast<std::size_t>(rows_each);
    return bands({0, count, count, {halo}, [&](int read, int) { return row_bytes * static_cast<std::size_t>(read); }},
                 whole ? no_budget : call.workspace.bytes.band);
}

int channels_of(Output output) {
    return output == Output::bent_normal ? 3 : 1;
}

params::grid_params result_grid(const Image& target, const Region& region) {
    return {.source_offset = 0,
            .target_offset = target.offset(),
            .source_stride = 0,
            .target_stride = to_u32(target.row_stride()),
            .x_begin = to_u32(region.x),
            .x_end = to_u32(region.x + region.width),
            .height = to_u32(region.height),
            .pixel_x = 0,
            .pixel_y = 0,
            .y_begin = to_u32(region.y)};
}

} // namespace fathom
