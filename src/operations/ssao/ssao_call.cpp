// What the passes of ssao share, which are constants, tables, and rows of inverse depth; and visible parts of the sky at the pixels
// of a lattice: planes, slices, and the filter over the jitter patterns.

#include "operations/ssao/ssao_call.hpp"

#include "operations/inverse_depth.hpp"
#include "operations/parameters.hpp"
#include "runtime/table.hpp"

#include <fathom/normals.hpp>

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
        return std::make_shared<const DeviceSlices>(DeviceSlices{{table.slices, table.levels, {}, {}, {}},
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
    params::grid_params grid = grid_parameters(Image(), target, region.x, region.x + region.width);
    grid.height = to_u32(region.height);
    grid.y_begin = to_u32(region.y);
    return grid;
}

namespace {

constexpr float slope_errors_fitted = 0.6f; // as slope_errors_neighbours, for a fit to seven pixels across

params::source_params source(const Image& image, const PixelLattice& lattice, int top) {
    const params::grid_params from = lattice_grid(image, lattice, top);
    return {.offset = from.source_offset, .stride = from.source_stride, .channels = to_u32(image.channels())};
}

// THICKNESS of kernels/ssao/ssao_planes.cl. What is infinite is `longest_length` thick.
int thickness_kind(const SsaoOptions& options) {
    return thickness_as<StoredDepth>(options) ? 2 : thickness_as<Image>(options) ? 1 : 0;
}

// The image's rows that belong to some rows of the planes: row 0 of these is the margin above the image.
Region rows_of(const Call& call, int first, int last) {
    const PixelLattice& lattice = call.lattice;
    const auto row = [&](int plane_row) {
        return std::clamp(lattice.y + lattice.every * (4 * (plane_row - 1) - (lattice.camera_y & 3)), 0,
                          call.stored.image.height());
    };
    return {0, row(first), call.stored.image.width(), row(last) - row(first)};
}

// Normals that the slopes come from, if not from differences of neighbours: the given ones, or fitted ones.
Image normals_for(runtime::Scratch& scratch, const StoredDepth& stored, const SsaoOptions& options) {
    if (!fits_normals(stored, options))
        return options.normals;
    const Image fitted = scratch.image(Element::f32, {stored.image.width(), stored.image.height(), 3});
    normals(stored, fitted, {.method = NormalMethod::least_squares, .tolerance = std::max(options.tolerance, 1.0)});
    return fitted;
}

} // namespace

Planes split_into_planes(Call& call, const Image& depth) {
    const SsaoOptions& options = call.options;
    const std::size_t all_rows = call.split.rows + std::size_t{2};
    const auto plane = [&](std::size_t i) {
        return call.scratch.image_in(call.workspace.planes[i], Element::f32, call.layout_of_rows(all_rows));
    };
    const Planes planes{plane(0), plane(1), plane(2)};
    constexpr int halo = 1; // row of the planes, four of the image
    static_assert(4 * halo > params::depth_margin_rows, "fitted normals look so far");
    for (const Band& band : depth_bands(call, depth, static_cast<int>(all_rows), halo, 4 * call.lattice.every)) {
        runtime::Scratch scratch(call.device);
        const Region rows = rows_of(call, band.first, band.last);
        const StoredDepth part = part_of(call.stored, rows);
        const Image here = depth_of(call, scratch, depth, rows).image;
        Image extra = here;
        params::grid_params extra_grid = lattice_grid(here, call.lattice, rows.y);
        if (const auto* back = thickness_as<StoredDepth>(options)) {
            extra = inverse_depth(scratch, part_of(*back, rows));
            extra_grid = lattice_grid(extra, call.lattice, rows.y);
        } else if (const auto* map = thickness_as<Image>(options)) {
            extra = *map;
            extra_grid = lattice_grid(extra, call.lattice);
        }
        const Image given = normals_for(scratch, part, options), normals = given ? given : here;
        call.occlusion.slope_errors =
            options.normals && !has_slopes(options)
                ? 0
                : static_cast<float>(call.lattice.every) * (given ? slope_errors_fitted : slope_errors_neighbours);
        params::grid_params from = lattice_grid(here, call.lattice, rows.y);
        from.y_begin = 4 * to_u32(band.begin);
        runtime::launch(call.device,
                        call.kernel("ssao_planes", {{"THICKNESS", thickness_kind(options)},
                                                    {"GIVEN_NORMALS", has_slopes(options) ? 3
                                                                      : options.normals   ? 1
                                                                      : given             ? 2
                                                                                          : 0},
                                                    {"CLAMP", options.border == Border::clamp},
                                                    {"EVERY", call.lattice.every}}),
                        {call.vectors(call.split.plane), 4 * static_cast<std::size_t>(band.end - band.begin)}, here,
                        extra, normals, call.blocks, planes.fronts, planes.backs, planes.slopes, from,
                        lattice_grid(here, pixel_lattice(call.stored), rows.y), extra_grid,
                        source(normals, call.lattice, options.normals ? 0 : rows.y), call.split, call.work,
                        call.occlusion);
    }
    return planes;
}

namespace {

void filter(const Call& call, const Planes& planes, const Image& sums, const params::band_params& rows, Output output,
            const Image& result, const Region& region) {
    const int reach = call.chosen.jitter == 16 ? 2 : call.chosen.jitter == 4 ? 1 : 0;
    runtime::launch(call.device,
                    call.kernel("denoise", {{"REACH", reach},
                                            {"OUTPUT", static_cast<int>(output)},
                                            {"CLAMP", call.options.border == Border::clamp}}),
                    {call.vectors(call.split.columns), static_cast<std::size_t>(region.height)}, planes.fronts,
                    planes.slopes, sums, call.blocks, result, result_grid(result, region), call.split, rows, call.work,
                    call.occlusion);
}

} // namespace

void add_up(Call& call, const Planes& planes, const std::vector<Wanted>& results, const Region& region) {
    const SsaoOptions& options = call.options;
    const params::split_params& split = call.split;
    const int kinds = sums_of(options);
    const auto rows = static_cast<int>(split.rows), end = region.y + region.height;
    const auto offset = static_cast<int>(split.pixel_y & 3);
    // The filter looks one row of the planes up and down. So two rows of sums stay for the next band.
    const std::size_t row_bytes = sizeof(float) * split.stride * static_cast<std::size_t>(kinds);
    const auto all = static_cast<std::size_t>(rows) + 2;
    const std::size_t kept = rows_of_sums(all, row_bytes, call.workspace.bytes);
    const std::size_t in_memory = std::min(kept, all);
    const Image sums =
        call.scratch.image(Element::f32, call.layout_of_rows(in_memory * static_cast<std::size_t>(kinds)));
    const Image taps = call.table->taps.on(call.device), turns = call.table->turns.on(call.device),
                counts = call.table->counts.on(call.device);
    constexpr params::u32 band = params::ssao_band;
    const std::size_t columns = (split.columns + band - 1) / band * band;
    runtime::Kernel& slices = call.kernel("ssao", {{"CONFIDENCE", options.confidence},
                                                   {"BENT", options.bent_normal},
                                                   {"CLAMP", options.border == Border::clamp}});

    const int first = std::max((region.y + offset) / 4 - 1, 0), last = std::min((end + offset + 3) / 4 + 1, rows);
    int filtered = region.y;
    for (int begin = first; begin < last; begin += static_cast<int>(kept) - 2) {
        const int next = std::min(begin + static_cast<int>(kept) - 2, last);
        const params::band_params here{to_u32(begin), to_u32(next - begin), to_u32(kept - 1),
                                       to_u32(in_memory * split.stride)};
        runtime::launch(call.device, slices, {call.vectors(to_u32(columns)) * params::split_planes * here.rows, 1},
                        planes.fronts, planes.backs, planes.slopes, taps, turns, counts, call.blocks, sums, split, here,
                        call.work, call.occlusion);
        const int until = next == last ? end : std::min(4 * (next - 1) - offset, end);
        if (until <= filtered)
            continue;
        for (const auto& [output, result] : results)
            filter(call, planes, sums, here, output,
                   result.region(0, filtered - region.y, region.width, until - filtered),
                   {region.x, filtered, region.width, until - filtered});
        filtered = until;
    }
}

} // namespace fathom
