// From a camera and options to the kernels' structs: pure functions, no device.

#include "camera/rays.hpp"
#include "catch.hpp"
#include "operations/parameters.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Camera camera(DepthSpan span = {0.5, 8}) {
    return {.projection = perspective(1.0, 1.5, span), .width = 30, .height = 20};
}

params::depth_params parameters(const Camera& camera, Storage storage = Storage::float32,
                                Background background = Background::inf, Arithmetic arithmetic = Arithmetic::fp64) {
    return depth_parameters(depth_form(camera, storage), storage, background, arithmetic);
}

/// What the reciprocal form of camera.h makes of a stored value.
double reciprocal(const params::depth_params& p, double v) {
    const double t = static_cast<double>(p.sign) * v + static_cast<double>(p.end);
    const double gain = static_cast<double>(p.gain_high) + static_cast<double>(p.gain_low);
    return gain / (t + (static_cast<double>(p.pole_high) + static_cast<double>(p.pole_low)));
}

double high(params::wide value) {
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(value)));
}
double low(params::wide value) {
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(value >> 32)));
}

} // namespace

TEST_CASE("parameters: a wide constant is a double's bits, or two floats that share them", "[parameters]") {
    for (const long double value : {0.1L, -3.0L, 1e9L / 7, 1e-12L, 0.0L}) {
        CHECK(std::bit_cast<double>(pack_wide(value, Arithmetic::fp64)) == static_cast<double>(value));
        const params::wide pair = pack_wide(value, Arithmetic::two_float);
        CHECK(high(pair) == static_cast<double>(static_cast<float>(value)));
        CHECK(std::abs(high(pair) + low(pair) - static_cast<double>(value)) <=
              0x1p-48 * std::abs(static_cast<double>(value)));
    }
}

TEST_CASE("parameters: the reciprocal form counts from the far end, and all its terms are positive", "[parameters]") {
    for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed})
        for (const double far : {8.0, 1e9, infinity})
            for (const Storage storage : {Storage::float32, Storage::uint16, Storage::uint24}) {
                const params::depth_params p = parameters(camera({0.5, far, order}), storage);
                const double largest = storage_max(storage), far_end = order == DepthOrder::reversed ? 0 : largest;
                INFO(to_string(storage) << ", far " << far);
                CHECK(static_cast<double>(p.sign) * far_end + static_cast<double>(p.end) == 0);
                CHECK(p.gain_high > 0);
                CHECK(p.pole_high >= 0);
                CHECK(reciprocal(p, largest - far_end) == Approx(0.5).epsilon(1e-12));
                if (std::isinf(far))
                    CHECK(std::isinf(reciprocal(p, far_end)));
                else
                    CHECK(reciprocal(p, far_end) == Approx(far).epsilon(0x1p-32));
            }
}

TEST_CASE("parameters: what the background becomes", "[parameters]") {
    CHECK(std::isinf(parameters(camera(), Storage::float32, Background::inf).background_depth));
    CHECK(std::isnan(parameters(camera(), Storage::float32, Background::nan).background_depth));
    CHECK(parameters(camera(), Storage::float32, Background::inf).background_mask == ~0u);
    CHECK(parameters(camera(), Storage::float32, Background::nan).background_mask == ~0u);
    CHECK(parameters(camera(), Storage::float32, Background::decode).background_mask == 0u);
    Camera metric = camera();
    metric.encoding = Encoding::view_z;
    CHECK(parameters(metric, Storage::uint16).background_mask == 0u); // an integer holds no infinity
}

TEST_CASE("parameters: limits of the stored value are rounded outwards", "[parameters]") {
    Camera range = camera();
    range.depth_range = {0.9, 0.1};
    const params::depth_params p = parameters(range);
    CHECK(static_cast<double>(p.lowest) <= 0.1);
    CHECK(static_cast<double>(std::nextafter(p.lowest, 1.0f)) > 0.1);
    CHECK(static_cast<double>(p.highest) >= 0.9);
    CHECK(static_cast<double>(std::nextafter(p.highest, 0.0f)) < 0.9);
    CHECK(parameters(camera(), Storage::uint24).highest == 16777215.0f);
    CHECK(parameters(camera(), Storage::uint16).lowest == 0.0f);
}

TEST_CASE("parameters: packed bytes and shifted codes", "[parameters]") {
    const auto red_low = parameters(camera(), Storage::rgb8_red_low);
    const auto red_high = parameters(camera(), Storage::rgb8_red_high);
    CHECK(red_low.byte_weights[0] == 1);
    CHECK(red_low.byte_weights[1] == 256);
    CHECK(red_low.byte_weights[2] == 65536);
    CHECK(red_high.byte_weights[0] == 65536);
    CHECK(red_high.byte_weights[2] == 1);
    // B comes first in memory: the weights of R, G, B run the other way.
    CHECK(std::ranges::equal(parameters(camera(), Storage::bgr8_red_low).byte_weights, red_high.byte_weights));
    CHECK(std::ranges::equal(parameters(camera(), Storage::bgr8_red_high).byte_weights, red_low.byte_weights));
    CHECK(parameters(camera(), Storage::uint24).code_shift == 0);
    CHECK(parameters(camera(), Storage::uint24_high).code_shift == 8);
}

TEST_CASE("parameters: a perspective wants what is in front of its camera centre, orthographic rays take all",
          "[parameters]") {
    CHECK(parameters(camera()).least_depth == 0.0f);
    Camera orthographic_camera = camera();
    orthographic_camera.projection = orthographic({-1, 1, -1, 1}, {-5, 5});
    CHECK(parameters(orthographic_camera).least_depth == -std::numeric_limits<float>::infinity());
}

TEST_CASE("parameters: the triangular length is as long as the directions", "[parameters]") {
    Eigen::Matrix4d tilted = perspective(1.0, 1.5, {0.5, 8}).matrix.cast<double>();
    tilted(3, 0) = 0.2;
    Camera with_tilt = camera();
    with_tilt.projection = from_matrix(tilted);
    for (const Camera& each : {camera(), with_tilt}) {
        const Rays r = camera_rays(each);
        const params::ray_params p = ray_parameters(r, Arithmetic::fp64);
        for (const Eigen::Vector3d& pixel : {Eigen::Vector3d(0.5, 0.5, 1), Eigen::Vector3d(29.5, 3.5, 1)}) {
            Eigen::Vector3d direction = Eigen::Vector3d::Zero(), length = Eigen::Vector3d::Zero();
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) {
                    direction(i) += std::bit_cast<double>(p.direction[i][j]) * pixel(j);
                    length(i) += std::bit_cast<double>(p.length[i][j]) * pixel(j);
                }
            CHECK(length.norm() == Approx(direction.norm()).epsilon(1e-14));
        }
        CHECK(p.length[1][0] == 0);
        CHECK(p.length[2][0] == 0);
        CHECK(p.length[2][1] == 0);
    }
}

TEST_CASE("parameters: rays in the world start at the camera centre, counted from the origin", "[parameters]") {
    Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
    view.topRightCorner<3, 1>() = Eigen::Vector3d(-1e6, 2, 3);
    const Rays world = rays_in_world(camera_rays(camera()), view, {1e6, 0, 0});
    CHECK(std::abs(static_cast<double>(world.origin(0, 2))) < 1e6 * 0x1p-60);
    CHECK(static_cast<double>(world.origin(1, 2)) == -2);
    CHECK(static_cast<double>(world.origin(2, 2)) == -3);

    view(3, 0) = 1e-3;
    CHECK_THROWS_AS(rays_in_world(camera_rays(camera()), view, {0, 0, 0}), std::invalid_argument);
    CHECK_THROWS_AS(rays_in_world(camera_rays(camera()), Eigen::Matrix4d::Zero(), {0, 0, 0}), std::invalid_argument);
    CHECK_THROWS_AS(rays_in_world(camera_rays(camera()), Eigen::Matrix4d::Identity(), {NAN, 0, 0}),
                    std::invalid_argument);
}

TEST_CASE("parameters: the background's bits are those of the stored clear value", "[parameters]") {
    const Camera standard = camera(), reversed = camera({0.5, 8, DepthOrder::reversed});
    CHECK(parameters(standard).background == 0x3f800000u);
    CHECK(parameters(reversed).background == 0u);
    CHECK(parameters(standard, Storage::float16).background == 0x3c00u);
    CHECK(parameters(standard, Storage::uint16).background == 0xffffu);
    CHECK(parameters(standard, Storage::uint24_high).background == 0xffffffu);
    CHECK(parameters(reversed, Storage::uint24).background == 0u);

    Camera metric = camera();
    metric.encoding = Encoding::view_z;
    CHECK(parameters(metric).background == 0x7f800000u);
    CHECK(parameters(metric, Storage::uint16).background_mask == 0u); // an integer holds no infinity
    metric.background = 0;
    CHECK(parameters(metric, Storage::uint16).background_mask == ~0u);
    metric.background = 0.5;
    CHECK_THROWS_AS(parameters(metric, Storage::uint16), std::invalid_argument);
    metric.background = 1e-9;
    CHECK_THROWS_AS(parameters(metric, Storage::float16), std::invalid_argument);

    Camera range = camera();
    range.depth_range = {1, 0};
    CHECK(parameters(range).background == 0u);
    range.depth_range = {-1, 1};
    CHECK(parameters(range).background == 0x3f800000u);
}
