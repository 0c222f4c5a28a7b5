// Stored values and options at the edges: both ends of the range, units from 1e-34 to 1e34, values that are no depth, and what is
// refused.

#include "catch.hpp"
#include "seen.hpp"
#include "stability.hpp"

using namespace fathom;
using namespace fathom::stability;
using seen::refusal;

namespace {

/// A camera for each form, `unit` scene units to what was one.
std::vector<Camera> of_every_form(double unit) {
    const Projection wide = perspective(1.0, 1.5, {0.1 * unit, 100 * unit});
    const Projection orthographic_projection =
        orthographic({-5 * unit, 6 * unit, -4 * unit, 3 * unit}, {0.5 * unit, 500 * unit});
    Eigen::Matrix4d tilt = wide.matrix.cast<double>();
    tilt.row(3) = Eigen::RowVector4d(0.06, -0.04, -1, 0);
    std::vector<Camera> cameras{camera_of(wide), camera_of(with_oblique_near_plane(wide, {0.2, 0.1, -1, -3 * unit})),
                                camera_of(orthographic_projection),
                                camera_of(with_oblique_near_plane(orthographic_projection, {0.2, 0.1, -1, -3 * unit})),
                                camera_of(from_matrix(tilt))};
    Camera logarithmic = camera_of(wide), distance = logarithmic, median = logarithmic;
    logarithmic.encoding = Encoding::logarithmic;
    logarithmic.far_plane = 100 * unit;
    logarithmic.log_c = 1 / unit;
    distance.encoding = Encoding::ray_distance;
    distance.scale = 10 * unit;
    median.encoding = Encoding::median;
    median.median = 5 * unit;
    cameras.insert(cameras.end(), {logarithmic, distance, median});
    return cameras;
}

} // namespace

TEST_CASE("stability: stored depth exactly 0 and 1, one ulp inside and one outside", "[stability]") {
    const float below_one = std::nextafter(1.0f, 0.0f), above_one = std::nextafter(1.0f, 2.0f);
    const float denormal = std::numeric_limits<float>::denorm_min();
    const std::vector<float> stored{0.0f, -0.0f, denormal, -denormal, 1.0f, below_one, above_one};
    for (const Arithmetic arithmetic : oracle::arithmetics())
        for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed}) {
            const bool reversed = order == DepthOrder::reversed;
            for (const Projection& p :
                 {perspective(1.0, 1.5, {2, 64, order}), orthographic({-1, 1, -1, 1}, {2, 64, order})}) {
                INFO((reversed ? "reversed " : "")
                     << (p.is_perspective() ? "perspective " : "orthographic ") << oracle::name(arithmetic));
                const auto z = decoded(camera_of(p), stored, Storage::float32, Background::inf, arithmetic);
                const float near = 2, far = 64;
                CHECK(z[0] == (reversed ? infinity : near));
                CHECK(z[1] == (reversed ? infinity : near)); // −0 is 0
                CHECK(z[2] == (reversed ? far : near));      // 1e-45 of the range away
                CHECK(std::isnan(z[3]));
                CHECK(z[4] == (reversed ? near : infinity));
                CHECK(std::isfinite(z[5]));
                CHECK((reversed ? z[5] >= near : z[5] < far)); // the step at 1 is far/near · 2⁻²⁴: seen at far only
                CHECK(std::isnan(z[6]));
                const auto kept = decoded(camera_of(p), stored, Storage::float32, Background::decode, arithmetic);
                CHECK(kept[reversed ? 0 : 4] == far);
                const auto none = decoded(camera_of(p), stored, Storage::float32, Background::nan, arithmetic);
                CHECK(std::isnan(none[reversed ? 0 : 4]));
            }
        }
}

TEST_CASE("stability: an infinite far plane at its own stored value", "[stability]") {
    for (const Arithmetic arithmetic : oracle::arithmetics())
        for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed}) {
            Camera camera = camera_of(perspective(1.0, 1.5, {0.1, HUGE_VAL, order}, Convention::direct3d()));
            const float far = order == DepthOrder::reversed ? 0.0f : 1.0f;
            const auto at = [&](float stored, Background background) {
                return decoded(camera, std::vector<float>{stored}, Storage::float32, background, arithmetic)[0];
            };
            CHECK(at(far, Background::inf) == infinity);
            CHECK(at(far, Background::decode) == infinity);
            CHECK(std::isnan(at(far, Background::nan)));
            camera.background = 0.5;
            CHECK(at(0.5f, Background::inf) == infinity);
            CHECK(at(far, Background::inf) == infinity); // the pole, though it is no background any more
            CHECK(at(far, Background::nan) == infinity);
            CHECK(std::isnan(at(0.5f, Background::nan)));
            // A tilted near plane puts the pole somewhere else in every pixel; beyond it there is nothing.
            camera.background.reset();
            camera.projection = with_oblique_near_plane(camera.projection, {0.2, 0.1, 1, -3});
            CHECK(at(far, Background::inf) == infinity);
            CHECK(!(at(far, Background::decode) < 0));
        }
}

// A depth is exact where it, and every coefficient's low part of two floats, is a normal float.
constexpr int largest_unit = 34; // powers of ten; the farthest depth of these cameras is 500 units

TEST_CASE("stability: scene units from 1e-34 to 1e34 decode to the same digits", "[stability]") {
    std::vector<float> stored;
    for (int i = 1; i <= 64; ++i)
        stored.push_back(static_cast<float>(i) / 65);
    for (const Arithmetic arithmetic : oracle::arithmetics()) {
        const auto plain = of_every_form(1);
        // Both results are within so many ulp, of two roundings each at most; the unit itself is one more.
        const double ulps = arithmetic == Arithmetic::fp64 ? linearize_ulp_fp64 : linearize_ulp_two_float;
        double worst = 0;
        for (std::size_t f = 0; f < plain.size(); ++f) {
            const auto reference = decoded(plain[f], stored, Storage::float32, Background::inf, arithmetic);
            for (int power = -largest_unit; power <= largest_unit; ++power) {
                INFO(to_string(depth_form(plain[f]).form) << " 1e" << power << ' ' << oracle::name(arithmetic));
                const double unit = std::pow(10.0, power);
                const Camera camera = of_every_form(unit)[f];
                CHECK(depth_form(camera).form == depth_form(plain[f]).form);
                const auto z = decoded(camera, stored, Storage::float32, Background::inf, arithmetic);
                double error = 0;
                for (std::size_t i = 0; i < z.size(); ++i) {
                    REQUIRE(std::isnan(z[i]) == std::isnan(reference[i]));
                    if (!std::isnan(z[i]))
                        error = std::max(error, std::abs(z[i] / unit / reference[i] - 1));
                }
                CHECK(error <= (4 * ulps + 1) * 0x1p-24);
                worst = std::max(worst, error);
            }
        }
        std::printf("units from 1e-34 to 1e34, %s: worst %.2f roundings\n", oracle::name(arithmetic), worst * 0x1p24);
    }
    // Beyond the largest float a depth is infinite.
    const Camera vast = camera_of(orthographic({-1, 1, -1, 1}, {0, 1e39}));
    CHECK(decoded(vast, std::vector<float>{0.5f})[0] == infinity);
}

TEST_CASE("stability: a background of every storage", "[stability]") {
    const auto check = [](Storage storage, double background, const auto& holding, const auto& beside) {
        Camera camera = camera_of(perspective(1.0, 1.5, {2, 64}));
        camera.background = background;
        using Value = std::decay_t<decltype(holding)>;
        for (const Arithmetic arithmetic : oracle::arithmetics()) {
            INFO(to_string(storage) << " background " << background);
            const std::vector<Value> values{holding, beside};
            const auto z = decoded(camera, values, storage, Background::inf, arithmetic);
            CHECK(z[0] == infinity);
            CHECK(!std::isinf(z[1]));
            CHECK(std::isnan(decoded(camera, values, storage, Background::nan, arithmetic)[0]));
            CHECK(!std::isinf(decoded(camera, values, storage, Background::decode, arithmetic)[0]));
        }
    };
    const auto half = [](unsigned bits) { return static_cast<std::uint16_t>(bits); };
    check(Storage::float32, 0.25, 0.25f, 0.26f);
    check(Storage::float32, 0.1, 0.1f, std::nextafter(0.1f, 1.0f)); // the nearest float is meant
    check(Storage::float32, -1, -1.0f, 0.5f);                       // outside the range
    check(Storage::float16, 1, half(0x3c00), half(0x3bff));
    check(Storage::float16, 0, half(0x0000), half(0x0001));
    check(Storage::float16, 0, half(0x8000), half(0x0001)); // −0 is 0
    check(Storage::float16, 0x1p-24, half(0x0001), half(0x0002));
    check(Storage::float16, 0x1p-14 - 0x1p-24, half(0x03ff), half(0x0400)); // denormal, and the first that is not
    check(Storage::float16, 0x1p-14, half(0x0400), half(0x03ff));
    check(Storage::float16, 65504, half(0x7bff), half(0x3800));
    check(Storage::float16, -2, half(0xc000), half(0x3800));
    check(Storage::uint16, 65535, std::uint16_t{65535}, std::uint16_t{65534});
    check(Storage::uint16, 0, std::uint16_t{0}, std::uint16_t{1});
    check(Storage::uint24, 16777215, std::uint32_t{0xffffff}, std::uint32_t{0xfffffe});
    check(Storage::uint24, 5, std::uint32_t{0xff000005}, std::uint32_t{0x00000006}); // the stencil is not compared
    check(Storage::uint24_high, 5, std::uint32_t{0x000005ff}, std::uint32_t{0x000006ff});
    check(Storage::rgb8_red_low, 0x030201, std::array<std::uint8_t, 3>{1, 2, 3}, std::array<std::uint8_t, 3>{3, 2, 1});
    check(Storage::rgb8_red_high, 0x030201, std::array<std::uint8_t, 3>{3, 2, 1}, std::array<std::uint8_t, 3>{1, 2, 3});

    Camera camera = camera_of(perspective(1.0, 1.5, {2, 64}));
    const auto refused = [&](Storage storage, double background) {
        camera.background = background;
        return refusal([&] { depth_form(camera, storage); });
    };
    CHECK(contains(refused(Storage::float16, 0.1), "is not a float16 value"));
    CHECK(contains(refused(Storage::float16, 65505), "is not a float16 value"));
    CHECK(contains(refused(Storage::float16, 0x1p-25), "is not a float16 value"));
    CHECK(contains(refused(Storage::uint16, 65536), "is not a uint16 code"));
    CHECK(contains(refused(Storage::uint16, 1.5), "is not a uint16 code"));
    CHECK(contains(refused(Storage::uint24, -1), "is not a uint24 code"));
    CHECK(refused(Storage::float32, std::nan("")).empty()); // no value is the background
}

TEST_CASE("stability: metric depth that is infinite, zero or behind the camera centre", "[stability]") {
    const std::vector<float> stored{infinity, -infinity, -1.0f, 0.0f, 2.0f, not_a_number, -0.0f};
    for (const Arithmetic arithmetic : oracle::arithmetics()) {
        const auto decode = [&](const Projection& p, Encoding encoding) {
            Camera camera = camera_of(p);
            camera.encoding = encoding;
            return decoded(camera, stored, Storage::float32, Background::inf, arithmetic);
        };
        const Projection perspective_projection = perspective(1.0, 1.5, {0.1, 100}),
                         orthographic_projection = orthographic({-1, 1, -1, 1}, {-10, 10});
        for (const Encoding encoding : {Encoding::view_z, Encoding::ray_distance}) {
            INFO(to_string(encoding) << ' ' << oracle::name(arithmetic));
            const auto z = decode(perspective_projection, encoding), flat = decode(orthographic_projection, encoding);
            CHECK(z[0] == infinity);
            CHECK(flat[0] == infinity);
            CHECK(z[4] > 0);
            CHECK(flat[4] == 2);
            for (const std::size_t none : {1u, 2u, 3u, 5u, 6u})
                CHECK(std::isnan(z[none])); // the camera centre, behind it, and no number
            CHECK(std::isnan(flat[1]));
            CHECK(std::isnan(flat[5]));
        }
        // Orthographic rays have no camera centre to be behind.
        CHECK(decode(orthographic_projection, Encoding::view_z)[2] == -1);
        CHECK(decode(orthographic_projection, Encoding::view_z)[3] == 0);
        const auto inverse = decode(perspective_projection, Encoding::inverse);
        CHECK(std::isnan(inverse[0])); // z = 0
        CHECK(std::isnan(inverse[2]));
        CHECK(inverse[3] == infinity); // no disparity: nothing there
        CHECK(inverse[4] == 0.5f);
    }
}

TEST_CASE("stability: what cannot be placed is refused", "[stability]") {
    const Device& device = oracle::device();
    const Camera camera = camera_of(perspective(1.0, 1.5, {0.1, 100}), 8, 4);
    const Image image(device, Element::f32, {8, 4});
    const auto said = [&](auto change) {
        Camera changed = camera;
        UnprojectOptions options{.space = Space::world};
        changed.view = Eigen::Matrix4d::Identity();
        change(changed, options);
        return refusal([&] { unproject({image, changed}, options); });
    };
    CHECK(said([](Camera&, UnprojectOptions&) {}) == "");
    device.finish(); // PoCL crashes where a program ends while a kernel is still being compiled
    CHECK(
        contains(said([](Camera& c, UnprojectOptions&) { c.view->row(1).setZero(); }), "the view matrix is singular"));
    CHECK(contains(said([](Camera& c, UnprojectOptions&) { (*c.view)(3, 0) = 1e-3; }), "fourth row of 0 0 0 1"));
    CHECK(contains(said([](Camera& c, UnprojectOptions&) { (*c.view)(0, 3) = HUGE_VAL; }), "must be finite"));
    CHECK(contains(said([](Camera& c, UnprojectOptions&) { c.view.reset(); }), "need the camera's view matrix"));
    CHECK(contains(said([](Camera&, UnprojectOptions& o) { o.origin.y() = std::nan(""); }), "three finite numbers"));

    // Orthographic rays at right angles to the view axis: their points have no depth of their own.
    Eigen::Matrix4d sideways = orthographic({-1, 1, -1, 1}, {1, 10}).matrix.cast<double>();
    sideways.row(0).swap(sideways.row(2));
    Camera across = camera;
    across.projection = from_matrix(sideways);
    CHECK(contains(refusal([&] { camera_rays(across); }), "run across the view axis"));
    CHECK(contains(refusal([&] { unproject({image, across}); }), "run across the view axis"));
}
