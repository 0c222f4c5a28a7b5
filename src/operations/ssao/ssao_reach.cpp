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

std::vector<int> ssao_reaches(const StoredDepth& stored, const CentreRays& rays, int begin, int end,
                              const SsaoReach& reach, std::size_t band_bytes) {
    const int height = stored.image.height();
    const auto count = static_cast<std::size_t>(height);
    const std::vector<float> nearest =
        rays.perspective ? nearest_in_rows(stored, band_bytes) : std::vector<float>(count, 1.0f);
    const auto nearest_of_all = static_cast<double>(*std::ranges::max_element(nearest));
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

double nearest_inverse_depth(const StoredDepth& stored, std::size_t band_bytes) {
    const std::vector<float> nearest = nearest_in_rows(stored, band_bytes);
    return std::max(static_cast<double>(*std::ranges::max_element(nearest)), 0.0);
}

// A sphere covers the most rows at one end of the image: what they grow with is convex.
double ssao_rows(const Camera& camera, const CentreRays& rays, const SsaoReach& reach, double nearest) {
    return std::max(own_rows(rays, reach, 0, nearest, nearest), own_rows(rays, reach, camera.height, nearest, nearest));
}

double ssao_columns(const Camera& camera, const CentreRays& rays, const SsaoReach& reach, double nearest) {
    const CentreRays across = turned(rays);
    return std::max(own_rows(across, reach, 0, nearest, nearest),
                    own_rows(across, reach, camera.width, nearest, nearest));
}

} // namespace fathom
