// Which rows ssao computes at a time, and what that takes.

#include "operations/ssao/ssao_plan.hpp"

#include "operations/parameters.hpp"
#include "operations/ssao/ssao_reach.hpp"

#include <fathom/error.hpp>

#include <algorithm>
#include <limits>

namespace fathom {
namespace {

constexpr PassBytes pass_bytes{std::size_t{24} << 20, std::size_t{64} << 20};

// The same where a budget has the image in bands.
constexpr PassBytes pass_bytes_of_band{std::size_t{8} << 20, 0};

// Elements of a plane image are counted in 32 bits.
constexpr std::size_t most_plane_elements = std::size_t{1} << 31;

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

} // namespace

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

SsaoPlan plan_of(const StoredDepth& stored, double radius, const SsaoOptions& options) {
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

} // namespace fathom
