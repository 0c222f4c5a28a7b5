// Which rows ssao computes at a time, and what that takes.

#include "operations/ssao/ssao_plan.hpp"

#include "description/check.hpp"
#include "description/ssao.hpp"
#include "operations/cheapest.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/parameters.hpp"
#include "operations/ssao/ssao_call.hpp"
#include "require.hpp"
#include "runtime/scratch.hpp"

#include <fathom/tiles.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace fathom {

// How far ssao looks from each row of an image. A sphere of radius r around a surface of inverse depth q at row y covers the
// rows whose planes of rays it touches. With s0 and s1 what a pixel to the right and one down add to a ray, a = s0 x (ray of
// the row at x = 0), b = s0 x s1 and K = b . (ray at x = y = 0) it touches those e rows away where
//   e^2 K^2 / q^2 = r^2 |a + e b|^2,   the same for every column

namespace {

using Vector = Eigen::Vector3d;

// The kernel computes a sphere's extent in floats, to less than this.
constexpr double rounding = 1.01;

// Rows beyond the sphere: slopes, samples between pixels, the filter and the interpolation; and, where blocks are chosen, what
// they are chosen by.
constexpr int beyond = 48, beyond_half = 128;

// Rows whose spheres a result depends on, above and below its own: those of the filter's and of the interpolation.
constexpr int mixed_rows = 8;

// The nearest surface of each row, as inverse depth: -FLT_MAX where a row has none.
std::vector<float> nearest_in_rows(const StoredDepth& stored, std::size_t band_bytes) {
    const Device& device = stored.image.device();
    const int width = stored.image.width(), height = stored.image.height();
    runtime::Scratch all(device);
    const Image nearest = all.image(Element::f32, {height, 1});
    runtime::Kernel& kernel =
        runtime::kernel(device, "nearest_rows", {{"V", device.options().vector_width}, {"STREAM", 0}});
    const RowNeeds of_image{0, height, height, {0}, [&](int, int made) {
                                return sizeof(float) * static_cast<std::size_t>(width) * static_cast<std::size_t>(made);
                            }};
    for (const Band& band : bands(of_image, band_bytes)) {
        runtime::Scratch scratch(device);
        const int rows = band.end - band.begin;
        const Image depth = inverse_depth(scratch, stored.region(0, band.begin, width, rows));
        params::grid_params grid = grid_parameters(depth, nearest, 0, width);
        grid.y_begin = to_u32(band.begin);
        runtime::launch(device, kernel, {static_cast<std::size_t>(rows), 1}, depth, nearest, grid);
    }
    return runtime::on_host<float>(nearest);
}

double shortest_step(const CentreRays& rays) {
    const auto& moving = rays.perspective ? rays.direction : rays.origin;
    const Vector right = moving.col(0).cast<double>(), down = moving.col(1).cast<double>();
    return std::min({right.norm(), down.norm(), (right + down).norm(), (right - down).norm()});
}

} // namespace

double rows_of_sphere(const CentreRays& rays, double radius, double y, double nearest) {
    const auto& moving = rays.perspective ? rays.direction : rays.origin;
    const Vector right = moving.col(0).cast<double>(), down = moving.col(1).cast<double>(),
                 ahead = rays.direction.col(2).cast<double>();
    if (!rays.perspective) {
        const Vector across = right.cross(ahead);
        return radius * across.norm() / std::abs(down.dot(across));
    }
    const Vector a = right.cross(down * y + ahead), b = right.cross(down);
    const double of_depth = b.dot(ahead) / nearest, square = radius * radius;
    const double first = of_depth * of_depth - square * b.squaredNorm(), middle = square * std::abs(a.dot(b));
    if (!(first > 0))
        return std::numeric_limits<double>::infinity();
    return (middle + std::sqrt(middle * middle + first * square * a.squaredNorm())) / first;
}

namespace {

// How far beside a pixel lies what decides on its result.
struct SsaoReach {
    double radius;      // scene units
    int samples;        // on a side of a slice, the fewest of any pass
    bool half;          // are some results interpolated?
    double silhouettes; // length that they are looked for in, scene units; 0: they are not
};

// Rows to the farthest one that decides on what is seen at row `y` of the camera: the sphere around its nearest surface, and what
// does not depend on the row, for which the nearest of all decides. 0 where there is no surface.
double own_rows(const CentreRays& rays, const SsaoReach& reach, double y, double nearest, double nearest_of_all) {
    if (nearest <= 0)
        return 0;
    // From a sample within the sphere the next one is at most so much farther away: see `distances` in operations/ssao/slices.cpp.
    const double next = std::pow(1 + std::cbrt(2.0) / reach.samples, 1.5);
    const double silhouettes =
        reach.silhouettes > 0
            ? reach.silhouettes * (rays.perspective ? std::max(nearest_of_all, 0.0) : 1) / shortest_step(rays)
            : 0;
    const double besides = rounding * silhouettes + (reach.half ? beyond_half : beyond);
    return std::ceil(next * rows_of_sphere(rays, rounding * reach.radius, y, rounding * nearest) + besides);
}

// Rays whose columns are the others' rows.
CentreRays turned(CentreRays rays) {
    rays.origin.col(0).swap(rays.origin.col(1));
    rays.direction.col(0).swap(rays.direction.col(1));
    return rays;
}

// How far rows [begin, end) of the depth's image reach. Waits for the device where the camera is a perspective one.
std::vector<int> ssao_reaches(const StoredDepth& stored, const CentreRays& rays, int begin, int end,
                              const SsaoReach& reach, std::size_t band_bytes) {
    const int height = stored.image.height();
    const auto count = static_cast<std::size_t>(height);
    const std::vector<float> nearest =
        rays.perspective ? nearest_in_rows(stored, band_bytes) : std::vector<float>(count, 1.0f);
    const auto nearest_of_all = static_cast<double>(std::ranges::max(nearest));
    std::vector<int> own(count, 0);
    for (int row = 0; row < height; ++row) {
        const auto q = static_cast<double>(nearest[static_cast<std::size_t>(row)]);
        own[static_cast<std::size_t>(row)] =
            static_cast<int>(std::min(own_rows(rays, reach, stored.y + row + 0.5, q, nearest_of_all), 1.0 * height));
    }
    std::vector<int> reaches;
    for (int row = begin; row < end; ++row) {
        const auto first = own.begin() + std::max(row - mixed_rows, 0),
                   last = own.begin() + std::min(row + mixed_rows + 1, height);
        reaches.push_back(std::max(*std::max_element(first, last), mixed_rows));
    }
    return reaches;
}

constexpr PassBytes pass_bytes{std::size_t{24} << 20, std::size_t{64} << 20};

// The same where a budget has the image in bands.
constexpr PassBytes pass_bytes_of_band{std::size_t{8} << 20, 0};

// Elements of a plane image are counted in 32 bits.
constexpr std::size_t most_plane_elements = std::size_t{1} << 31;

// Of all pixels, or of those at half resolution.
Counts counts_of_pass(const Tile& tile, const SsaoOptions& options, int every) {
    return counts_of(sampling_of(every == 2 && chooses_blocks(tile, options) ? half_options(options) : options));
}

// Bytes that the passes take for so many rows of the depth, with their tables.
std::size_t bytes_between(const Tile& tile, const SsaoOptions& options, int rows, const PassBytes& pass) {
    if (plane_bytes(tile, options, rows) / sizeof(float) >= most_plane_elements)
        return std::numeric_limits<std::size_t>::max();
    const int width = tile.pixels.width;
    const std::vector<int> passes = passes_of(tile, options);
    const bool half = passes.back() == 2, blocks = passes.size() == 2;
    const auto floats = [](double columns, double count) {
        return static_cast<std::size_t>((columns + 32) * (count + 8) * sizeof(float));
    };
    // Rows of inverse depth that a pass reads at a time: at least those of a few rows of planes, or of three rows of blocks.
    const int least = std::max(blocks ? 3 << params::ssao_block_shift : 0, 12 * passes.back());
    const bool shared = (half || has_silhouettes(options)) && shares_depth(width, rows, options, pass);
    const int at_once =
        shared ? rows : std::min(rows, std::max(least, static_cast<int>(pass.band / floats(width, 0) * 8)));
    const int depths = 1 + (thickness_as<StoredDepth>(options) ? 1 : 0) + (fits_normals(tile, options) ? 4 : 0);
    std::size_t bytes =
        3 * plane_bytes(tile, options, rows) + static_cast<std::size_t>(depths) * floats(width, at_once);
    if (has_silhouettes(options))
        bytes += floats(width, rows);
    std::size_t of_pass = 0; // one after the other
    for (const int every : passes) {
        PixelLattice lattice = pixel_lattice(tile, every);
        lattice.height = (rows + every - 1) / every;
        const params::split_params split = split_parameters(lattice);
        const std::size_t row_bytes = sizeof(float) * split.stride * static_cast<std::size_t>(sums_of(options));
        const std::size_t all = split.rows + std::size_t{3};
        std::size_t here = std::min(rows_of_sums(all, row_bytes, pass), all) * row_bytes;
        if (every == 2)
            for (const int channels : {1, options.confidence ? 1 : 0, options.bent_normal ? 3 : 0})
                here += channels > 0 ? floats(channels * (width / 2.0), rows / 2.0) : 0;
        of_pass = std::max(of_pass, here);
        bytes += slice_table_bytes(counts_of_pass(tile, options, every), longest_side_of(tile, every));
    }
    bytes += of_pass;
    constexpr std::size_t small = std::size_t{1} << 18; // images of blocks, and of rows
    return bytes + small;
}

SsaoReach reach_of(const Tile& tile, double length, const SsaoOptions& options) {
    const double radius = std::min(length, longest_length);
    SsaoReach reach{radius, 256, false, has_silhouettes(options) ? silhouette_most * radius : 0};
    for (const int every : passes_of(tile, options)) {
        reach.samples = std::min(reach.samples, counts_of_pass(tile, options, every).samples);
        reach.half = every == 2;
    }
    return reach;
}

SsaoOptions settled(const Tile& tile, const SsaoOptions& options) {
    describe(description::Check{}, options);
    return std::holds_alternative<MaxError>(options.sampling) ? chosen(tile, options) : options;
}

Reach reach_in(const Camera& camera, const CentreRays& rays, const SsaoReach& reach, double nearest) {
    // A sphere covers the most rows at one end of the image: what they grow with is convex.
    const auto most = [&](const CentreRays& along, int size) {
        const double rows =
            std::max(own_rows(along, reach, 0, nearest, nearest), own_rows(along, reach, size, nearest, nearest));
        return static_cast<int>(std::min(rows, 1.0 * size));
    };
    return {most(turned(rays), camera.width), most(rays, camera.height)};
}

// Under a perspective: 1/w, which is greatest in a corner of the image.
double inverse_depth_of(const Camera& camera, const CentreRays& rays, double depth) {
    const long double beyond_centre = depth - rays.centre_depth;
    require(beyond_centre > 0, "nearest = ", depth, " does not lie before the camera");
    long double step = 0;
    for (const int x : {0, camera.width})
        for (const int y : {0, camera.height})
            step = std::max(step, rays.depth(0) * x + rays.depth(1) * y + rays.depth(2));
    return static_cast<double>(step / beyond_centre);
}

} // namespace

std::size_t plane_bytes(const Tile& tile, const SsaoOptions& options, int rows) {
    std::size_t most = 0;
    for (const int every : passes_of(tile, options)) {
        PixelLattice lattice = pixel_lattice(tile, every);
        lattice.height = (rows + every - 1) / every;
        const params::split_params split = split_parameters(lattice);
        // One row more: where the band begins decides on how many there are.
        most = std::max(
            most, Image::allocation(Element::f32, {static_cast<int>(split.stride), static_cast<int>(split.rows) + 3}));
    }
    return most;
}

SsaoPlan ssao_plan(const StoredDepth& stored, double radius, const SsaoOptions& options) {
    const Tile tile = stored;
    const Region region = region_of(stored, options);
    const int height = stored.image.height(), end = region.y + region.height;
    const std::size_t budget = budget_of(stored.image.device());
    if (bytes_between(tile, options, height, pass_bytes) <= budget) // and the device need not be asked
        return {{{region.y, end, 0, height}}, pass_bytes};
    const RowNeeds rows{
        .begin = region.y,
        .end = end,
        .height = height,
        .reaches = ssao_reaches(stored, centre_rays(camera_rays(stored.camera)), region.y, end,
                                reach_of(tile, radius, options), pass_bytes_of_band.band),
        .bytes = [&](int read, int) { return bytes_between(tile, options, read, pass_bytes_of_band); },
        .least = 64,
    };
    return {bands(rows, budget,
                  text("ssao of ", ImageSize{tile.pixels.width, height}, " pixels with a radius of ", radius)),
            pass_bytes_of_band};
}

Reach reach(const Tile& tile, double radius, const SsaoOptions& options, double nearest) {
    description::Check{}("radius", radius, description::ssao_radius);
    if (tile.camera.lens) { // a radius at a pole covers whole rows
        static_cast<void>(settled(tile, options));
        return {tile.camera.width, tile.camera.height};
    }
    const CentreRays rays = centre_rays(camera_rays(tile.camera));
    return reach_in(tile.camera, rays, reach_of(tile, radius, settled(tile, options)),
                    rays.perspective ? inverse_depth_of(tile.camera, rays, nearest) : 1);
}

Reach reach(const StoredDepth& stored, double radius, const SsaoOptions& options) {
    check_stored(stored);
    if (stored.camera.lens)
        return reach(static_cast<const Tile&>(Tile(stored)), radius, options, 0);
    description::Check{}("radius", radius, description::ssao_radius);
    const CentreRays rays = centre_rays(camera_rays(stored.camera));
    const double nearest = // 0: background alone
        rays.perspective ? std::max(std::ranges::max(nearest_in_rows(stored, pass_bytes.band)), 0.0f) : 1;
    return reach_in(stored.camera, rays, reach_of(stored, radius, settled(stored, options)), nearest);
}

std::size_t bytes(const Tile& tile, const SsaoOptions& options) {
    if (tile.camera.lens)
        return bytes_through_lens(tile, settled(tile, options));
    return bytes_between(tile, settled(tile, options), tile.pixels.height, pass_bytes);
}

} // namespace fathom
