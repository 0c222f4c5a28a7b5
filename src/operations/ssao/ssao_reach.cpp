// How far ssao looks from each row of an image. A sphere of radius r around a surface of inverse depth q at row y covers the
// rows whose planes of rays it touches. With s0 and s1 what a pixel to the right and one down add to a ray, a = s0 x (ray of
// the row at x = 0), b = s0 x s1 and K = b . (ray at x = y = 0) it touches those e rows away where
//   e^2 K^2 / q^2 = r^2 |a + e b|^2,   the same for every column

#include "operations/ssao/ssao_reach.hpp"

#include "operations/inverse_depth.hpp"
#include "operations/parameters.hpp"
#include "runtime/scratch.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace fathom {
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
std::vector<float> nearest_in_rows(const StoredDepth& stored, const CentreRays& rays, std::size_t band_bytes) {
    const Device& device = stored.image.device();
    const int width = stored.image.width(), height = stored.image.height();
    runtime::Scratch all(device);
    const Image nearest = all.image(Element::f32, {height, 1});
    runtime::Kernel& kernel =
        runtime::kernel(device, "nearest_rows", {{"V", device.options().vector_width}, {"STREAM", 0}});
    for (const Band& band : bands(height, 0, {sizeof(float) * static_cast<std::size_t>(width)}, band_bytes)) {
        runtime::Scratch scratch(device);
        const int rows = band.end - band.begin;
        const Image depth = inverse_depth(scratch, stored.region(0, band.begin, width, rows), rays);
        params::grid_params grid{};
        grid.source_offset = depth.offset();
        grid.source_stride = to_u32(depth.row_stride());
        grid.x_end = to_u32(width);
        grid.height = to_u32(rows);
        grid.y_begin = to_u32(band.begin);
        runtime::launch(device, kernel, {static_cast<std::size_t>(rows), 1}, depth, nearest, grid);
    }
    std::vector<float> found(static_cast<std::size_t>(height));
    nearest.download(found.data());
    return found;
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

ReachingRows ssao_rows(const StoredDepth& stored, const CentreRays& rays, int begin, int end, const SsaoReach& reach,
                       std::size_t band_bytes) {
    const int height = stored.image.height();
    const auto count = static_cast<std::size_t>(height);
    const std::vector<float> nearest =
        rays.perspective ? nearest_in_rows(stored, rays, band_bytes) : std::vector<float>(count, 1.0f);
    // From a sample within the sphere the next one is at most so much farther away: see `distances` in operations/ssao/slices.cpp.
    const double next = std::pow(1 + std::cbrt(2.0) / reach.samples, 1.5);
    double silhouettes = 0;
    if (reach.silhouettes > 0)
        silhouettes = reach.silhouettes * (rays.perspective ? std::max(*std::ranges::max_element(nearest), 0.0f) : 1) /
                      shortest_step(rays);
    const double besides = rounding * silhouettes + (reach.half ? beyond_half : beyond);
    std::vector<int> own(count, 0);
    for (int row = 0; row < height; ++row) {
        const auto q = static_cast<double>(nearest[static_cast<std::size_t>(row)]);
        if (q <= 0)
            continue; // no surface
        const double rows = rows_of_sphere(rays, rounding * reach.radius, stored.y + row + 0.5, rounding * q);
        own[static_cast<std::size_t>(row)] = static_cast<int>(std::min(std::ceil(next * rows + besides), 1.0 * height));
    }
    ReachingRows result{begin, end, height, {}};
    for (int row = begin; row < end; ++row) {
        const auto first = own.begin() + std::max(row - mixed_rows, 0),
                   last = own.begin() + std::min(row + mixed_rows + 1, height);
        result.reaches.push_back(std::max(*std::max_element(first, last), mixed_rows));
    }
    return result;
}

} // namespace fathom
