// Ambient occlusion from stored depth: inverse depth, planes, slices, and the filter over the jitter patterns. At half
// resolution all of that is done for every second pixel of every second row, before joint upsampling.

#include <fathom/ssao.hpp>

#include <fathom/normals.hpp>

#include "description/check.hpp"
#include "description/ssao.hpp"
#include "operations/bands.hpp"
#include "operations/cheapest.hpp"
#include "operations/parameters.hpp"
#include "operations/silhouette.hpp"
#include "operations/ssao.hpp"
#include "operations/ssao_reach.hpp"
#include "require.hpp"
#include "runtime/kept.hpp"
#include "runtime/launched.hpp"
#include "runtime/scratch.hpp"
#include "runtime/table.hpp"

#include <Eigen/LU>

#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace fathom {
namespace {

constexpr float slope_errors_fitted = 0.6f; // as slope_errors_neighbours, for a fit to seven pixels across

// Widths of a pixel that a neighbour may lie off the tangent plane and still be of the same surface.
constexpr float filter_edge = 0.5f;

// What lies between the passes, besides the planes.
struct PassBytes {
    std::size_t band;   // Inverse depth and the slices' sums are made in bands of rows that take at most so much.
    std::size_t shared; // Inverse depth that takes no more than this is made once for all passes that read it.
};
constexpr PassBytes pass_bytes{std::size_t{24} << 20, std::size_t{64} << 20};

// The same where a budget has the image in bands.
constexpr PassBytes pass_bytes_of_band{std::size_t{8} << 20, 0};

// Elements of a plane image are counted in 32 bits.
constexpr std::size_t most_plane_elements = std::size_t{1} << 31;

// Lengths are squared in floats. Every visible surface is nearer than this.
constexpr double longest_length = 1e18;

struct Counts {
    int slices, samples, jitter;
};

// How a quality chooses blocks of half resolution, and samples there. docs/research/ambient-occlusion.md has the measurements.
struct HalfResolution {
    int samples;
    double least_px; // radius on every surface of such a block, pixels
    bool smooth;     // no low steps and thin objects: kernels/ssao/ssao_blocks.cl
};
constexpr HalfResolution half_of_quality[] = {{16, 48, false}, {48, 128, true}, {36, 48, true}};

// A block at half resolution needs results so many pixels beyond it: a seam, one more to interpolate, and the filter.
constexpr params::u32 half_margin = 16;

void check_size(const Image& image, const StoredDepth& stored, const char* what) {
    check_device(stored, {what, image});
    const int width = stored.image.width(), height = stored.image.height();
    require(image.width() == width && image.height() == height, "the ", what, " are ",
            ImageSize{image.width(), image.height()}, " pixels, the depth ", ImageSize{width, height});
    require(image.element() == Element::f32, "the ", what, " must be floats");
}

// How far a second layer's rays may differ from the first's, relative to their length: other clip planes round them.
constexpr long double rays_rounding = 1e-6L;

bool same_rays(const StoredDepth& a, const StoredDepth& b) {
    const CentreRays first = centre_rays(camera_rays(a.camera)), second = centre_rays(camera_rays(b.camera));
    const auto same = [](const auto& one, const auto& other) {
        return (one - other).norm() <= rays_rounding * one.norm();
    };
    return first.perspective == second.perspective && same(first.direction, second.direction) &&
           same(first.origin, second.origin) && a.x == b.x && a.y == b.y;
}

// The thickness that the options give in this way, if they do.
template <typename Way>
const Way* thickness_as(const SsaoOptions& options) {
    return options.thickness ? std::get_if<Way>(&*options.thickness) : nullptr;
}

bool has_silhouettes(const SsaoOptions& options) {
    return thickness_as<Silhouette>(options) != nullptr;
}

// Of options whose tolerance has become a method.
const Sampling& sampling_of(const SsaoOptions& options) {
    return std::get<Sampling>(options.sampling);
}

bool is_half(const SsaoOptions& options) {
    return sampling_of(options).half_resolution.value_or(false);
}

void check_sampling(const StoredDepth& stored, const Sampling& sampling) {
    if (sampling.half_resolution.value_or(false)) {
        const PixelLattice half = pixel_lattice(stored, 2);
        require(half.width > 0 && half.height > 0, "half_resolution looks from even columns and rows, and the depth's ",
                ImageSize{stored.image.width(), stored.image.height()}, " pixels at (", stored.x, ", ", stored.y,
                ") have none");
    }
}

void check_thickness(const StoredDepth& stored, const SsaoOptions& options) {
    if (const auto* map = thickness_as<Image>(options)) {
        require(static_cast<bool>(*map), "the thickness map has no image");
        check_size(*map, stored, "thicknesses");
        require(map->channels() == 1, "the thickness map must have one channel");
    }
    if (const auto* back = thickness_as<StoredDepth>(options)) {
        check_stored(*back);
        check_device(stored, {"the second layer", back->image});
        const ImageSize size{back->image.width(), back->image.height()};
        require(size.width == stored.image.width() && size.height == stored.image.height(), "the second layer is ",
                size, " pixels, the depth ", ImageSize{stored.image.width(), stored.image.height()});
        require(same_rays(stored, *back),
                "the second layer is seen along other rays than the depth: both need the same frustum and place in it, "
                "whatever their clip range and encoding");
    }
}

void check(const StoredDepth& stored, double radius, const SsaoOptions& options) {
    check_stored(stored);
    require<ImageTooLarge>(std::max(stored.image.width(), stored.image.height()) <= longest_side, "an image of ",
                           ImageSize{stored.image.width(), stored.image.height()}, " pixels: at most ", longest_side,
                           " in a row or column");
    description::Check{}("radius", radius, description::ssao_radius);
    describe(description::Check{}, options);
    if (const auto* sampling = std::get_if<Sampling>(&options.sampling))
        check_sampling(stored, *sampling);
    check_thickness(stored, options);
    if (options.normals) {
        check_size(options.normals, stored, "normals");
        require(options.normals.channels() == 3 || options.normals.channels() == 4, "the normals have ",
                options.normals.channels(), " channels; they must have 3 or 4");
        require(options.normals_space == Space::view || stored.camera.view,
                "normals in the world need the camera's view matrix, and it has none");
    }
    if (options.region) {
        const Region& r = *options.region;
        require(r.x >= 0 && r.y >= 0 && r.width > 0 && r.height > 0 && r.x <= stored.image.width() - r.width &&
                    r.y <= stored.image.height() - r.height,
                "region ", ImageSize{r.width, r.height}, " at (", r.x, ", ", r.y, ") does not lie in ",
                ImageSize{stored.image.width(), stored.image.height()}, " pixels");
    }
}

// Normals that the slopes come from: the given ones, or fitted ones if differences of neighbours show mostly the
// storage's steps.
bool fits_normals(const StoredDepth& stored, const SsaoOptions& options) {
    return !options.normals && (options.tolerance > 1 || is_coarse(stored));
}

Image normals_for(runtime::Scratch& scratch, const StoredDepth& stored, const SsaoOptions& options) {
    if (!fits_normals(stored, options))
        return options.normals;
    const Image fitted = scratch.image(Element::f32, {stored.image.width(), stored.image.height(), 3});
    normals(stored, fitted, {.method = NormalMethod::least_squares, .tolerance = std::max(options.tolerance, 1.0)});
    return fitted;
}

Counts counts_of(const Sampling& sampling) {
    constexpr Counts of_quality[] = {{1, 6, 16}, {1, 32, 16}, {4, 30, 4}};
    Counts chosen = of_quality[static_cast<int>(sampling.quality)];
    chosen.slices = sampling.slices.value_or(chosen.slices);
    chosen.samples = sampling.samples.value_or(chosen.samples);
    chosen.jitter = sampling.jitter.value_or(chosen.jitter);
    return chosen;
}

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

namespace {

params::source_params source(const Image& image, const PixelLattice& lattice, int top) {
    const params::grid_params from = lattice_grid(image, lattice, top);
    return {.offset = from.source_offset, .stride = from.source_stride, .channels = to_u32(image.channels())};
}

// Where the result of the filter goes: the region's columns, from its first row on.
params::grid_params grid(const Image& target, const Region& region) {
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

// THICKNESS of kernels/ssao/ssao_planes.cl. What is infinite is `longest_length` thick.
int thickness_kind(const SsaoOptions& options) {
    return has_silhouettes(options) ? 3 : thickness_as<StoredDepth>(options) ? 2 : thickness_as<Image>(options) ? 1 : 0;
}

// A slice table on the device.
struct DeviceSlices {
    static constexpr const char* name = "slices";
    SliceTable sizes; // without its values
    runtime::Table taps, turns, counts;

    std::size_t bytes() const { return 4 * static_cast<std::size_t>(taps.count + turns.count + counts.count); }
};

// What a slice table is made from.
struct SliceKey {
    std::uint64_t falloff; // the bits of a double
    int slices, samples, largest_radius, jitter;
    std::uint32_t seed;
    PlaneLayout place;
    std::uint32_t reserved = 0;
};

std::shared_ptr<const DeviceSlices> slices_on(const Device& device, const SliceKey& key) {
    return runtime::kept<DeviceSlices>(device, key, [&] {
        const SliceTable table = slice_table(key.slices, key.samples, key.largest_radius, key.jitter,
                                             std::bit_cast<double>(key.falloff), key.seed, key.place);
        return std::make_shared<const DeviceSlices>(
            DeviceSlices{{table.slices, table.samples, table.levels, {}, {}, {}},
                         runtime::table(device, Element::f32, table.taps),
                         runtime::table(device, Element::f32, table.turns),
                         runtime::table(device, Element::u32, table.counts)});
    });
}

// Of a lattice of all pixels, or of every second one.
int longest_side_of(const StoredDepth& stored, int every) {
    const PixelLattice lattice = pixel_lattice(stored, every);
    return std::max(lattice.width, lattice.height);
}

// What the bands of a call share.
struct Workspace {
    runtime::Scratch scratch;
    PassBytes bytes;
    const StoredDepth& whole;    // whose sides the tables are made for
    std::array<Image, 3> planes; // fronts, backs and slopes, in turn of all pixels and of those at half resolution
};

// One pass's camera, pixels and constants, and where its images come from.
struct Call {
    Workspace& workspace;
    const StoredDepth& stored;
    double radius;
    const SsaoOptions& options;
    const Device& device;
    CentreRays rays;
    PixelLattice lattice;
    params::split_params split;
    Counts chosen;
    std::shared_ptr<const DeviceSlices> table;
    params::occlusion_params occlusion;
    runtime::Scratch scratch;
    Image blocks;                // what each block is computed at; any table as long as the call works for all pixels
    params::block_params work{}; // which blocks this call works for: all, unless it is told

    Call(const StoredDepth& depth, double length, const SsaoOptions& asked, Workspace& shared)
        : workspace(shared), stored(depth), radius(length), options(asked), device(depth.image.device()),
          rays(centre_rays(camera_rays(depth.camera))), lattice(pixel_lattice(depth, is_half(asked) ? 2 : 1)),
          split(split_parameters(lattice)), chosen(counts_of(sampling_of(asked))),
          table(slices_on(device, {std::bit_cast<std::uint64_t>(asked.falloff),
                                   chosen.slices,
                                   chosen.samples,
                                   longest_side_of(workspace.whole, lattice.every),
                                   chosen.jitter,
                                   asked.seed,
                                   {static_cast<int>(split.stride), static_cast<int>(split.plane)}})),
          occlusion(parameters(lattice)), scratch(device), blocks(table->counts.on(device)) {}

    params::occlusion_params parameters(const PixelLattice& pixels) const {
        return occlusion_parameters(stored.camera, rays_of(rays, pixels),
                                    inverse_depth_error(stored.camera, stored.storage), radius, options, table->sizes);
    }

    runtime::Kernel& kernel(const char* name, runtime::Defines defines) const {
        defines.insert(defines.end(),
                       {{"V", device.options().vector_width}, {"STREAM", 0}, {"PERSPECTIVE", rays.perspective}});
        return runtime::kernel(device, name, defines);
    }

    std::size_t vectors(params::u32 columns) const {
        return columns / static_cast<std::size_t>(device.options().vector_width);
    }

    /// Works for the blocks that have this word, and for a margin around them.
    void work_for(const Image& words, params::block_params chosen, params::u32 wanted, params::u32 margin) {
        blocks = words;
        work = chosen;
        work.every = to_u32(lattice.every);
        work.wanted = wanted;
        work.margin = margin;
    }

    /// Rows of all planes.
    Layout layout_of_rows(std::size_t count) const { return {static_cast<int>(split.stride), static_cast<int>(count)}; }
};

struct Planes {
    Image fronts, backs, slopes;
};

// The image's rows that belong to some rows of the planes: row 0 of these is the margin above the image.
Region rows_of(const Call& call, int first, int last) {
    const PixelLattice& lattice = call.lattice;
    const auto row = [&](int plane_row) {
        return std::clamp(lattice.y + lattice.every * (4 * (plane_row - 1) - (lattice.camera_y & 3)), 0,
                          call.stored.image.height());
    };
    return {0, row(first), call.stored.image.width(), row(last) - row(first)};
}

StoredDepth part_of(const StoredDepth& stored, const Region& rows) {
    return stored.region(rows.x, rows.y, rows.width, rows.height);
}

// Inverse depth of some rows, which begins with row `top` of the image.
struct DepthRows {
    Image image;
    int top;
};

// Those of the whole image, if that is there already.
DepthRows depth_of(const Call& call, runtime::Scratch& scratch, const Image& whole, const Region& rows) {
    return whole ? DepthRows{whole, 0}
                 : DepthRows{inverse_depth(scratch, part_of(call.stored, rows), call.rays), rows.y};
}

// Bands for a pass that reads inverse depth; one where all of it is there already.
std::vector<Band> depth_bands(const Call& call, const Image& whole, int count, int halo, int rows_each) {
    const std::size_t row_bytes =
        sizeof(float) * static_cast<std::size_t>(call.stored.image.width()) * static_cast<std::size_t>(rows_each);
    return bands(count, halo, {row_bytes}, whole ? std::numeric_limits<std::size_t>::max() : call.workspace.bytes.band);
}

// The planes of the whole image. `depth` is its inverse depth, if that is there already: silhouettes need it.
Planes split_into_planes(Call& call, const Image& depth) {
    const SsaoOptions& options = call.options;
    const std::size_t all_rows = call.split.rows + std::size_t{2};
    const auto plane = [&](std::size_t i) {
        return call.scratch.image_in(call.workspace.planes[i], Element::f32, call.layout_of_rows(all_rows));
    };
    const Planes planes{plane(0), plane(1), plane(2)};
    constexpr int halo = 1; // row of the planes, four of the image
    static_assert(4 * halo > params::depth_margin_rows, "fitted normals look so far");
    const Image silhouettes = has_silhouettes(options) ? silhouette_thickness(call.scratch, depth, call.lattice,
                                                                              call.rays.perspective, call.occlusion)
                                                       : Image();
    for (const Band& band : depth_bands(call, depth, static_cast<int>(all_rows), halo, 4 * call.lattice.every)) {
        runtime::Scratch scratch(call.device);
        const Region rows = rows_of(call, band.first, band.last);
        const StoredDepth part = part_of(call.stored, rows);
        const Image here = depth_of(call, scratch, depth, rows).image;
        Image extra = here;
        params::grid_params extra_grid = lattice_grid(here, call.lattice, rows.y);
        if (silhouettes) {
            extra = silhouettes;
            extra_grid = lattice_grid(extra, pixel_lattice({extra, call.stored.camera}));
        } else if (const auto* back = thickness_as<StoredDepth>(options)) {
            extra = inverse_depth(scratch, part_of(*back, rows), centre_rays(camera_rays(back->camera)));
            extra_grid = lattice_grid(extra, call.lattice, rows.y);
        } else if (const auto* map = thickness_as<Image>(options)) {
            extra = *map;
            extra_grid = lattice_grid(extra, call.lattice);
        }
        const Image given = normals_for(scratch, part, options), normals = given ? given : here;
        call.occlusion.slope_errors = options.normals ? 0
                                                      : static_cast<float>(call.lattice.every) *
                                                            (given ? slope_errors_fitted : slope_errors_neighbours);
        params::grid_params from = lattice_grid(here, call.lattice, rows.y);
        from.y_begin = 4 * to_u32(band.begin);
        runtime::launch(call.device,
                        call.kernel("ssao_planes", {{"THICKNESS", thickness_kind(options)},
                                                    {"GIVEN_NORMALS", options.normals ? 1
                                                                      : given         ? 2
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

// The filter's and the upsampling's OUTPUT, and how many channels it has.
enum class Output { visibility, confidence, bent_normal };

int channels_of(Output output) {
    return output == Output::bent_normal ? 3 : 1;
}

void filter(const Call& call, const Planes& planes, const Image& sums, const params::band_params& rows, Output output,
            const Image& result, const Region& region) {
    const int reach = call.chosen.jitter == 16 ? 2 : call.chosen.jitter == 4 ? 1 : 0;
    runtime::launch(call.device,
                    call.kernel("denoise", {{"REACH", reach},
                                            {"OUTPUT", static_cast<int>(output)},
                                            {"CLAMP", call.options.border == Border::clamp}}),
                    {call.vectors(call.split.columns), static_cast<std::size_t>(region.height)}, planes.fronts,
                    planes.slopes, sums, call.blocks, result, grid(result, region), call.split, rows, call.work,
                    call.occlusion);
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
        runtime::launch(
            call.device, call.kernel("joint_upsample", {{"OUTPUT", static_cast<int>(output)}}),
            {(columns + wide - 1) / wide, static_cast<std::size_t>(rows)}, here.image, found, call.blocks, part,
            lattice_grid(here.image, all, here.top), lattice_grid(found, pixel_lattice({found, call.stored.camera})),
            grid(part, {region.x, region.y + band.begin, region.width, rows}), call.work, call.parameters(all));
    }
}

// What is asked for, where it goes, and how messages name it.
struct Wanted {
    Output output;
    const char* name;
    const Image& image;
};

std::vector<Wanted> wanted(const SsaoOptions& options, const Occlusion& results) {
    std::vector<Wanted> all{{Output::visibility, "visibility", results.visibility}};
    if (options.confidence)
        all.push_back({Output::confidence, "confidence", results.confidence});
    if (options.bent_normal)
        all.push_back({Output::bent_normal, "bent_normal", results.bent_normal});
    return all;
}

Region region_of(const StoredDepth& stored, const SsaoOptions& options) {
    return options.region.value_or(Region{0, 0, stored.image.width(), stored.image.height()});
}

// What the presets do: a quality alone, and an image that has even columns and rows.
bool chooses_blocks(const StoredDepth& stored, const SsaoOptions& options) {
    const PixelLattice half = pixel_lattice(stored, 2);
    const Sampling& sampling = sampling_of(options);
    return !sampling.half_resolution && !sampling.slices && !sampling.samples && !sampling.jitter && half.width > 0 &&
           half.height > 0;
}

// How many kinds of sums there are.
int sums_of(const SsaoOptions& options) {
    return options.bent_normal ? 6 : options.confidence ? 3 : 2;
}

// Rows of sums that are kept at a time: a power of two.
std::size_t rows_of_sums(std::size_t all, std::size_t row_bytes, const PassBytes& bytes) {
    return std::min(std::bit_ceil(all), std::max(std::bit_floor(bytes.band / row_bytes), std::size_t{4}));
}

// The slices of a region's pixels, and the means of their sums, in bands of rows of the planes.
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
    runtime::Kernel& slices = call.kernel("ssao", {{"CONFIDENCE", options.confidence}, {"BENT", options.bent_normal}});

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
        for (const auto& [output, name, result] : results)
            filter(call, planes, sums, here, output,
                   result.region(0, filtered - region.y, region.width, until - filtered),
                   {region.x, filtered, region.width, until - filtered});
        filtered = until;
    }
}

void check_results(const StoredDepth& stored, const SsaoOptions& options, const std::vector<Wanted>& results) {
    const Image none;
    const auto* back = thickness_as<StoredDepth>(options);
    const auto* map = thickness_as<Image>(options);
    std::vector<NamedImage> others{{"the stored depth", stored.image},
                                   {"the second layer", back ? back->image : none},
                                   {"the thickness map", map ? *map : none},
                                   {"the normals", options.normals}};
    const Region region = region_of(stored, options);
    for (const Wanted& result : results) {
        check_result(stored, {result.name, result.image}, Element::f32,
                     {region.width, region.height, channels_of(result.output)}, others);
        others.push_back({result.name, result.image});
    }
}

} // namespace

namespace {

// All pixels of a region that the call works for.
void whole_resolution(Call& call, const Image& depth, const std::vector<Wanted>& results) {
    const Planes planes = split_into_planes(call, depth);
    add_up(call, planes, results, region_of(call.stored, call.options));
}

// Is inverse depth made once for several passes? Not if it takes so much memory that each had better make its own.
bool shares_depth(int width, int height, const SsaoOptions& options, const PassBytes& bytes) {
    return has_silhouettes(options) ||
           sizeof(float) * static_cast<std::size_t>(width) * static_cast<std::size_t>(height) <= bytes.shared;
}

Image shared_depth(Call& call) {
    const Image& image = call.stored.image;
    return shares_depth(image.width(), image.height(), call.options, call.workspace.bytes)
               ? inverse_depth(call.scratch, call.stored, call.rays)
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
    std::vector<Image> found;
    for (const Wanted& result : results)
        found.push_back(
            call.scratch.image(Element::f32, {call.lattice.width, call.lattice.height, channels_of(result.output)}));
    std::vector<Image> parts;
    for (const Image& image : found)
        parts.push_back(image.region(needed.x, needed.y, needed.width, needed.height));
    std::vector<Wanted> halves;
    for (std::size_t i = 0; i < found.size(); ++i)
        halves.push_back({results[i].output, results[i].name, parts[i]});
    add_up(call, planes, halves, needed);
    for (std::size_t i = 0; i < found.size(); ++i)
        upsample(call, depth, found[i], results[i].output, results[i].image, region);
}

// Which blocks of the camera's image are computed at all pixels, see kernels/ssao/blocks.h.
std::pair<Image, params::block_params> chosen_blocks(Call& call, const Image& depth, const HalfResolution& half) {
    const PixelLattice all = pixel_lattice(call.stored);
    const int x = call.stored.x >> params::ssao_block_shift, y = call.stored.y >> params::ssao_block_shift;
    const params::occlusion_params occlusion = call.parameters(all);
    // A radius of that many pixels, as inverse depth; without perspective it has them everywhere or nowhere.
    const auto least = static_cast<float>(half.least_px) * occlusion.pixel / occlusion.radius;
    const float none = std::numeric_limits<float>::infinity();
    const params::block_params chosen{
        .first_column = x,
        .first_row = y,
        .columns = to_u32(((call.stored.x + all.width - 1) >> params::ssao_block_shift) - x + 1),
        .rows = to_u32(((call.stored.y + all.height - 1) >> params::ssao_block_shift) - y + 1),
        .every = 1,
        .wanted = 0,
        .margin = 0,
        .least = call.rays.perspective ? least
                 : least > 1           ? none
                                       : -none,
        .smooth = half.smooth};
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
        runtime::launch(call.device, call.kernel("ssao_blocks", {}),
                        {chosen.columns, static_cast<std::size_t>(band.end - band.begin)}, here.image, blocks, from,
                        chosen, occlusion);
    }
    runtime::launch(call.device, call.kernel("ssao_kinds", {}), {1, 1}, blocks, chosen);
    return {blocks, chosen};
}

SsaoOptions half_options(const SsaoOptions& options) {
    SsaoOptions few = options;
    Sampling& sampling = std::get<Sampling>(few.sampling);
    sampling.half_resolution = true;
    sampling.samples = half_of_quality[static_cast<int>(sampling.quality)].samples;
    return few;
}

// The passes over a depth image, or over a band of one.
void occlude(Workspace& workspace, const StoredDepth& stored, double radius, const SsaoOptions& options,
             const std::vector<Wanted>& results) {
    if (!chooses_blocks(stored, options)) {
        const bool half = is_half(options);
        Call call(stored, radius, options, workspace);
        const Image depth = half || has_silhouettes(options) ? shared_depth(call) : Image();
        (half ? half_resolution : whole_resolution)(call, depth, results);
        return;
    }
    const SsaoOptions few_options = half_options(options);
    Call few(stored, radius, few_options, workspace);
    const Image depth = shared_depth(few);
    const auto [blocks, chosen] =
        chosen_blocks(few, depth, half_of_quality[static_cast<int>(sampling_of(options).quality)]);
    {
        Call all(stored, radius, options, workspace);
        all.work_for(blocks, chosen, 1, 0);
        whole_resolution(all, depth, results);
    }
    few.work_for(blocks, chosen, 0, half_margin);
    half_resolution(few, depth, results);
}

// The steps from pixel to pixel of the passes: 1 for all pixels, 2 for half resolution.
std::vector<int> passes_of(const StoredDepth& stored, const SsaoOptions& options) {
    if (chooses_blocks(stored, options))
        return {1, 2};
    return {is_half(options) ? 2 : 1};
}

// Bytes of the largest image of planes that any pass needs for so many rows of the depth.
std::size_t plane_bytes(const StoredDepth& stored, const SsaoOptions& options, int rows) {
    std::size_t most = 0;
    for (const int every : passes_of(stored, options)) {
        PixelLattice lattice = pixel_lattice(stored, every);
        lattice.height = (rows + every - 1) / every;
        const params::split_params split = split_parameters(lattice);
        // One row more: where the band begins decides on how many there are.
        most = std::max(
            most, Image::allocation(Element::f32, {static_cast<int>(split.stride), static_cast<int>(split.rows) + 3}));
    }
    return most;
}

// Bytes that the passes take for so many rows of the depth, with their tables.
std::size_t bytes_between(const StoredDepth& stored, const SsaoOptions& options, int rows, const PassBytes& pass,
                          std::size_t table_bytes) {
    const int width = stored.image.width();
    const std::vector<int> passes = passes_of(stored, options);
    const bool half = passes.back() == 2, blocks = passes.size() == 2;
    const auto floats = [](double columns, double count) {
        return static_cast<std::size_t>((columns + 32) * (count + 8) * sizeof(float));
    };
    // Rows of inverse depth that a pass reads at a time: at least those of a few rows of planes, or of three rows of blocks.
    const int least = std::max(blocks ? 3 << params::ssao_block_shift : 0, 12 * passes.back());
    const bool shared = (half || has_silhouettes(options)) && shares_depth(width, rows, options, pass);
    const int at_once =
        shared ? rows : std::min(rows, std::max(least, static_cast<int>(pass.band / floats(width, 0) * 8)));
    const int depths = 1 + (thickness_as<StoredDepth>(options) ? 1 : 0) + (fits_normals(stored, options) ? 4 : 0);
    std::size_t bytes =
        3 * plane_bytes(stored, options, rows) + static_cast<std::size_t>(depths) * floats(width, at_once);
    for (const int every : passes) {
        PixelLattice lattice = pixel_lattice(stored, every);
        lattice.height = (rows + every - 1) / every;
        const params::split_params split = split_parameters(lattice);
        const std::size_t row_bytes = sizeof(float) * split.stride * static_cast<std::size_t>(sums_of(options));
        const std::size_t all = split.rows + std::size_t{3};
        bytes += std::min(rows_of_sums(all, row_bytes, pass), all) * row_bytes;
        if (has_silhouettes(options))
            bytes += floats(lattice.width, lattice.height);
    }
    if (half)
        for (const int channels : {1, options.confidence ? 1 : 0, options.bent_normal ? 3 : 0})
            bytes += channels > 0 ? floats(channels * (width / 2.0), rows / 2.0) : 0;
    constexpr std::size_t small = std::size_t{1} << 18; // images of blocks, and of rows
    return bytes + small + table_bytes;
}

// Rows of the results in bands, and what each of them takes.
struct Plan {
    std::vector<Band> bands;
    PassBytes bytes;
};

// The whole image, or bands of it that keep to the device's budget.
Plan plan_of(const StoredDepth& stored, double radius, const SsaoOptions& options) {
    const Device& device = stored.image.device();
    const Region region = region_of(stored, options);
    const int width = stored.image.width(), height = stored.image.height();
    const std::size_t budget = device.options().memory_budget;
    const auto fits = [](std::size_t bytes) { return bytes / sizeof(float) < most_plane_elements; };
    const Band whole{region.y, region.y + region.height, 0, height};
    if (budget == 0 && fits(plane_bytes(stored, options, height)))
        return {{whole}, pass_bytes};

    std::size_t tables = 0;
    int samples = 256;
    for (const int every : passes_of(stored, options)) {
        const bool chosen_half = every == 2 && !sampling_of(options).half_resolution;
        const Counts counts = counts_of(sampling_of(chosen_half ? half_options(options) : options));
        tables += slice_table_bytes(counts.slices, counts.samples, longest_side_of(stored, every));
        samples = std::min(samples, counts.samples);
    }
    if (fits(plane_bytes(stored, options, height)) &&
        bytes_between(stored, options, height, pass_bytes, tables) <= budget)
        return {{whole}, pass_bytes};
    const bool half = passes_of(stored, options).back() == 2;
    const ReachingRows rows =
        ssao_rows(stored, centre_rays(camera_rays(stored.camera)), whole.begin, whole.end,
                  {std::min(radius, longest_length), samples, half,
                   has_silhouettes(options) ? silhouette_most * std::min(radius, longest_length) : 0},
                  pass_bytes_of_band.band);
    const std::size_t most = budget > 0 ? budget : std::numeric_limits<std::size_t>::max();
    const auto bytes = [&](int read, int) {
        return fits(plane_bytes(stored, options, read))
                   ? bytes_between(stored, options, read, pass_bytes_of_band, tables)
                   : std::numeric_limits<std::size_t>::max();
    };
    return {bands_within(rows, bytes, most,
                         text("ssao of ", ImageSize{width, height}, " pixels with a radius of ", radius)),
            pass_bytes_of_band};
}

} // namespace

void ssao(const StoredDepth& stored, const Occlusion& results, double radius, const SsaoOptions& options,
          const Launch& launch) {
    check(stored, radius, options);
    if (std::holds_alternative<MaxError>(options.sampling))
        return ssao(stored, results, radius, chosen(stored, options), launch);
    check_asked(options.bent_normal, {"bent_normal", results.bent_normal});
    check_asked(options.confidence, {"confidence", results.confidence});
    const std::vector<Wanted> results_wanted = wanted(options, results);
    check_results(stored, options, results_wanted);
    const Device& device = stored.image.device();
    const Region region = region_of(stored, options);
    const int width = stored.image.width();
    const runtime::Launched launched(device, launch);
    const Plan plan = plan_of(stored, radius, options);
    int most_rows = 0;
    for (const Band& band : plan.bands)
        most_rows = std::max(most_rows, band.last - band.first);
    Workspace workspace{runtime::Scratch(device), plan.bytes, stored, {}};
    const std::size_t elements = plane_bytes(stored, options, most_rows) / sizeof(float);
    for (Image& plane : workspace.planes)
        plane = workspace.scratch.image(Element::f32, {static_cast<int>(elements), 1});
    for (const Band& band : plan.bands) {
        const Region rows{0, band.first, width, band.last - band.first};
        SsaoOptions here = options;
        here.region = Region{region.x, band.begin - band.first, region.width, band.end - band.begin};
        if (const auto* map = thickness_as<Image>(options))
            here.thickness = map->region(rows.x, rows.y, rows.width, rows.height);
        if (options.normals)
            here.normals = options.normals.region(rows.x, rows.y, rows.width, rows.height);
        if (const auto* back = thickness_as<StoredDepth>(options))
            here.thickness = part_of(*back, rows);
        std::vector<Image> parts;
        for (const Wanted& result : results_wanted)
            parts.push_back(result.image.region(0, band.begin - region.y, region.width, band.end - band.begin));
        std::vector<Wanted> wanted_here;
        for (std::size_t i = 0; i < parts.size(); ++i)
            wanted_here.push_back({results_wanted[i].output, results_wanted[i].name, parts[i]});
        occlude(workspace, part_of(stored, rows), radius, here, wanted_here);
    }
    launched.done();
}

Occlusion ssao(const StoredDepth& stored, double radius, const SsaoOptions& options, const Launch& launch) {
    check(stored, radius, options);
    const Region region = region_of(stored, options);
    const auto image = [&](Output output, bool asked) {
        const Layout layout{region.width, region.height, channels_of(output)};
        return asked ? Image(stored.image.device(), Element::f32, layout) : Image();
    };
    const Occlusion results{.visibility = image(Output::visibility, true),
                            .bent_normal = image(Output::bent_normal, options.bent_normal),
                            .confidence = image(Output::confidence, options.confidence)};
    ssao(stored, results, radius, options, launch);
    return results;
}

} // namespace fathom
