// Normals from stored depth: kernels/camera/inverse_depth.cl, then kernels/normals/normals.cl.

#include "operations/normals.hpp"

#include "camera/rays.hpp"
#include "description/check.hpp"
#include "description/normals.hpp"
#include "lens/camera_lens.hpp"
#include "operations/cheapest.hpp"
#include "operations/inverse_depth.hpp"
#include "operations/lens_table.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/launch.hpp"

#include <fathom/tiles.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fathom {
namespace {

using Vector = Eigen::Matrix<long double, 3, 1>;

void check(const NormalsOptions& options) {
    describe(description::Check{}, options);
    if (options.noise != 0 && std::holds_alternative<MaxError>(options.method))
        throw std::invalid_argument(description::excluding("noise", "max_error"));
}

void check(const StoredDepth& stored, const NormalsOptions& options) {
    check_stored(stored);
    check(options);
    require(options.space == Space::view || stored.camera.view,
            "normals in the world need the camera's view matrix, and it has none");
}

void split(float (&target)[2], long double value) {
    target[0] = static_cast<float>(value);
    target[1] = static_cast<float>(value - target[0]);
}

// The columns of a perspective's rays, the third across the other two; `centre` is where it is so.
struct Columns {
    Eigen::Matrix<long double, 2, 1> centre;
    Vector right, down, ahead;
};

Columns columns_of(const Rays::Matrix& direction) {
    const auto across = direction.leftCols<2>();
    const Eigen::Matrix<long double, 2, 1> centre =
        -(across.transpose() * across).inverse() * across.transpose() * direction.col(2);
    const Vector right = direction.col(0), down = direction.col(1);
    return {centre, right, down, direction.col(2) + right * centre.x() + down * centre.y()};
}

} // namespace

int window_radius(const Camera& camera, double noise) {
    if (noise == 0)
        return normals_reach_least_squares;
    Eigen::Vector2d angle; // of a pixel across and down, where it is largest in a pinhole, and on the axis of a lens
    if (camera.lens) {
        angle = lens::CameraLens(camera).pixel_on_axis();
    } else {
        const CentreRays rays = centre_rays(camera_rays(camera));
        if (!rays.perspective) // whose error depends on the depth
            return 5;
        const Columns columns = columns_of(rays.direction);
        angle = {static_cast<double>(columns.right.norm() / columns.ahead.norm()),
                 static_cast<double>(columns.down.norm() / columns.ahead.norm())};
    }
    // A slope is off by the noise over the root of the sum of x^2 in the window, and the normal by that over a pixel's angle.
    const double one_pixel = std::sqrt(std::numbers::pi) / 2 * noise * std::hypot(1 / angle.x(), 1 / angle.y());
    for (const int radius : {3, 5}) {
        const double side = 2 * radius + 1, sum = side * side * radius * (radius + 1) / 3;
        if (one_pixel / std::sqrt(sum) <= normals_noise_error_deg * std::numbers::pi / 180)
            return radius;
    }
    return normals_reach_noise;
}

namespace {

void set_rays(params::normal_params& p, const CentreRays& rays) {
    Vector right = rays.origin.col(0), down = rays.origin.col(1), ahead = rays.direction.col(2);
    if (rays.perspective) {
        const Columns columns = columns_of(rays.direction);
        split(p.centre_x, columns.centre.x());
        split(p.centre_y, columns.centre.y());
        right = columns.right, down = columns.down, ahead = columns.ahead;
    }
    // Towards the camera is against the ray; in units of the largest, so that they are floats in any unit of length.
    Vector of_x = down.cross(ahead), of_y = ahead.cross(right), of_depth = right.cross(down);
    const long double largest = std::max({of_x.norm(), of_y.norm(), of_depth.norm()});
    const long double scale = (of_depth.dot(ahead) > 0 ? -1 : 1) / largest;
    for (int i = 0; i < 3; ++i) {
        p.of_slope_x[i] = static_cast<float>(of_x(i) * scale);
        p.of_slope_y[i] = static_cast<float>(of_y(i) * scale);
        p.of_depth[i] = static_cast<float>(of_depth(i) * scale);
    }
}

// Constants of kernels/normals/normals.cl for rays in the axes of the result, or for those of a lens.
params::normal_params normal_parameters(const CentreRays* rays, const InverseDepthError& error,
                                        const NormalsOptions& options) {
    params::normal_params p{};
    if (rays)
        set_rays(p, *rays);
    const auto times = static_cast<float>(options.tolerance);
    p.error_constant = error.constant * times;
    p.error_linear = error.linear * times;
    p.error_quadratic = error.quadratic * times;
    p.noise = static_cast<float>(options.noise);
    return p;
}

// Rows whose windows share lines, on a CPU: with 16 a 1080p image takes 2 % less time, and half as many threads find work.
constexpr int rows_of_a_work_item = 8;

} // namespace

NormalMethod chosen_method(const NormalsOptions& options, const Tile& tile) {
    if (const auto method = std::get<NormalMethod>(options.method); method != NormalMethod::automatic)
        return method;
    return is_coarse(tile) || options.noise > 0 ? NormalMethod::least_squares : NormalMethod::neighbours;
}

void normals(const StoredDepth& stored, const Image& result, const NormalsOptions& options, const Launch& launch) {
    check(stored, options);
    if (std::holds_alternative<MaxError>(options.method))
        return normals(stored, result, chosen(stored, options), launch);
    check_result(stored, result, options.channels);
    const Device& device = stored.image.device();
    const Camera& camera = stored.camera;
    const auto in_target = [&](const Rays& rays) {
        return options.space == Space::world ? rays_in_world(rays, *camera.view, Eigen::Vector3d::Zero()) : rays;
    };
    LensAxes axes;
    std::optional<CentreRays> target;
    if (camera.lens)
        axes.turn = in_target(axes_of_view()).direction.cast<double>();
    else
        target = centre_rays(in_target(camera_rays(camera)));
    const KernelLens lens(device, camera, axes);
    const int width = result.width();
    const runtime::Launched launched(device, launch);
    const bool fitted = chosen_method(options, stored) == NormalMethod::least_squares;
    const int vector_width = vector_width_for(device, width),
              radius = fitted ? window_radius(camera, options.noise) : 0;
    const int rows = vector_width == 1                       ? 1
                     : camera.lens                           ? params::lens_rows
                     : radius == normals_reach_least_squares ? rows_of_a_work_item
                                                             : 1;
    const runtime::Defines defines = lens.with_lens({{"V", vector_width},
                                                     {"STREAM", worth_streaming(result, vector_width)},
                                                     {"PERSPECTIVE", !target || target->perspective},
                                                     {"CHANNELS", options.channels},
                                                     {"RADIUS", radius},
                                                     {"ROWS", rows}});
    runtime::Kernel& kernel = runtime::kernel(device, "normals", defines);
    params::normal_params parameters =
        normal_parameters(target ? &*target : nullptr, stored_error(camera, stored.storage), options);
    over_inverse_depth(stored, Background::nan, reach(stored, options).rows, "normals", result,
                       [&](const Image& depth, const Image& made, const params::grid_params& grid) {
                           parameters.rows = to_u32(made.height());
                           lens.launch(device, kernel, range_of(width, (made.height() - 1) / rows + 1, vector_width),
                                       depth, made, grid, parameters);
                       });
    launched.done();
}

Image normals(const StoredDepth& stored, const NormalsOptions& options, const Launch& launch) {
    check(stored, options);
    return run_into_new_images(description::NormalsCall{.options = options}, stored, launch).result;
}

Reach reach(const Tile& tile, const NormalsOptions& options) {
    check(options);
    if (std::holds_alternative<MaxError>(options.method))
        return reach(tile, chosen(tile, options));
    const int pixels = chosen_method(options, tile) == NormalMethod::least_squares
                           ? window_radius(tile.camera, options.noise)
                           : normals_reach_neighbours;
    return {pixels, pixels};
}

std::size_t bytes(const Tile& tile, const NormalsOptions&) {
    return inverse_depth_bytes(tile.pixels.width, tile.pixels.height);
}

} // namespace fathom
