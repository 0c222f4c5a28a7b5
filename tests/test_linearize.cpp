// linearize against __float128: every form, convention and encoding, f/n from 2 to 10⁹, pixels up to 16384.
// The tolerances are the constants of fathom/linearize.hpp.

#include "catch.hpp"
#include "judge.hpp"
#include "stability.hpp"
#include "subjects.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using oracle::half_value;
using oracle::of_every_encoding;
using oracle::Subject;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
Camera with(const Projection& projection, int width) {
    return {.projection = projection, .width = width, .height = 1};
}

/// Codes as they lie in memory, and the numbers that they are.
struct StoredCodes {
    std::vector<unsigned char> bytes;
    std::vector<double> values;
};

// Floats have that sign.
StoredCodes random_codes(Storage storage, int count, double sign, std::mt19937& random) {
    StoredCodes codes;
    const auto append = [&](std::uint32_t bits, std::size_t size) {
        for (std::size_t i = 0; i < size; ++i)
            codes.bytes.push_back(static_cast<unsigned char>(bits >> (8 * i)));
    };
    for (int i = 0; i < count; ++i) {
        const std::uint32_t bits = i == 0   ? 0
                                   : i == 1 ? ~0u
                                            : static_cast<std::uint32_t>(random()),
                            code = bits & 0xffffff;
        switch (storage) {
        case Storage::float32: {
            const float value = std::copysign(std::ldexp(static_cast<float>(code), -24 - static_cast<int>(bits >> 28)),
                                              static_cast<float>(sign));
            append(std::bit_cast<std::uint32_t>(value), 4);
            codes.values.push_back(static_cast<double>(value));
            break;
        }
        case Storage::float16:
            append(bits & 0xffff, 2);
            codes.values.push_back(half_value(static_cast<std::uint16_t>(bits)));
            break;
        case Storage::uint8:
            append(bits & 0xff, 1);
            codes.values.push_back(bits & 0xff);
            break;
        case Storage::uint16:
            append(bits & 0xffff, 2);
            codes.values.push_back(bits & 0xffff);
            break;
        case Storage::uint24: // the rest of the word is anything
            append(bits, 4);
            codes.values.push_back(code);
            break;
        case Storage::uint24_high:
            append(bits << 8 | bits >> 24, 4);
            codes.values.push_back(code);
            break;
        case Storage::rgb8_red_low:
        case Storage::bgr8_red_high:
            append(code, 3);
            codes.values.push_back(code);
            break;
        case Storage::rgb8_red_high:
        case Storage::bgr8_red_low:
            append((code & 0xff) << 16 | (code & 0xff00) | code >> 16, 3);
            codes.values.push_back(code);
            break;
        }
    }
    return codes;
}

} // namespace

TEST_CASE("linearize: every form is within its bound, whatever the camera", "[linearize][exact]") {
    for (const auto& [name, subjects] : oracle::families())
        for (const Arithmetic arithmetic : oracle::arithmetics())
            CHECK(oracle::judge_all(name, subjects, arithmetic) == "");
}

TEST_CASE("linearize: every storage is decoded as its codes say", "[linearize][exact]") {
    constexpr std::pair<Storage, const char*> storages[] = {{Storage::float32, "float32"},
                                                            {Storage::float16, "float16"},
                                                            {Storage::uint8, "uint8"},
                                                            {Storage::uint16, "uint16"},
                                                            {Storage::uint24, "uint24"},
                                                            {Storage::uint24_high, "uint24-high"},
                                                            {Storage::rgb8_red_low, "rgb8-red-low"},
                                                            {Storage::rgb8_red_high, "rgb8-red-high"},
                                                            {Storage::bgr8_red_low, "bgr8-red-low"},
                                                            {Storage::bgr8_red_high, "bgr8-red-high"}};
    std::mt19937 random(7);
    // Codes become numbers before an encoding sees them: each storage is tried with a fifth of them, in turn.
    std::size_t turn = 0;
    for (const auto& [storage, storage_name] : storages)
        for (const Arithmetic arithmetic : oracle::arithmetics()) {
            oracle::Worst worst;
            oracle::Faults faults;
            ++turn;
            for (std::size_t place = turn; Subject subject : of_every_encoding()) {
                if (place++ % 5 != 0)
                    continue;
                subject.camera.width = subject.camera.height = 16384;
                const oracle::Truth truth(subject, storage);
                const Form form = depth_form(subject.camera, storage).form;
                const int width = 53, height = 29, x = 16384 - width, y = 77;
                const StoredCodes codes = random_codes(storage, width * height, subject.camera.scale, random);
                std::vector<float> depth(codes.values.size());
                const Image image = Image::from_host(oracle::device(arithmetic), element_of(storage),
                                                     codes.bytes.data(), {width, height, channels_of(storage)});
                linearize({image, subject.camera, storage, x, y}, {Background::decode}).image.download(depth.data());
                for (std::size_t i = 0; i < depth.size(); ++i)
                    faults.add(oracle::judge(subject, truth, form, oracle::promise(form, arithmetic), codes.values[i],
                                             x + static_cast<double>(i % width) + 0.5,
                                             y + static_cast<double>(i / width) + 0.5, depth[i], worst));
            }
            worst.print(std::string(storage_name) + ", " + oracle::name(arithmetic));
            CHECK(faults.text() == "");
        }
}

TEST_CASE("linearize: what was not measured is invalid, and from background_from on nothing is", "[linearize]") {
    const Projection wide = perspective(1.0, 1.5, {0.5, 8}), box = orthographic({-1, 1, -1, 1}, {-5, 8});
    const auto check = []<typename Value>(const Camera& camera, const std::vector<Value>& values,
                                          const std::vector<float>& expected, Background background = Background::inf,
                                          Storage storage = Storage::float32) {
        for (const Arithmetic arithmetic : oracle::arithmetics()) {
            const std::vector<float> z = stability::decoded(camera, values, storage, background, arithmetic);
            for (std::size_t i = 0; i < z.size(); ++i) {
                INFO("value " << i << ": " << z[i] << ", expected " << expected[i]);
                CHECK((z[i] == expected[i] || (std::isnan(z[i]) && std::isnan(expected[i]))));
            }
        }
    };
    using Floats = std::vector<float>;
    using Codes = std::vector<std::uint16_t>;
    Camera metres = with(wide, 6);
    metres.encoding = Encoding::view_z;
    metres.background_from = 1e10;
    metres.missing = -1;
    const Floats values{1e10f, std::nextafter(1e10f, 0.0f), 3e10f, INFINITY, -1.0f, 2.0f};
    check(metres, values, {INFINITY, values[1], INFINITY, INFINITY, NAN, 2});
    check(metres, values, {NAN, values[1], NAN, NAN, NAN, 2}, Background::nan);
    check(metres, values, {1e10f, values[1], 3e10f, INFINITY, NAN, 2}, Background::decode);

    Camera orthographic_metres = with(box, 3); // 0 is a depth like any other there
    orthographic_metres.encoding = Encoding::view_z;
    check(orthographic_metres, Floats{0, -2, 3}, {0, -2, 3});
    orthographic_metres.missing = 0;
    check(orthographic_metres, Floats{0, -2, 3}, {NAN, -2, 3});

    Camera disparity = with(wide, 4); // the smaller the farther
    disparity.encoding = Encoding::inverse;
    disparity.scale = 2;
    disparity.background_from = 0.25;
    check(disparity, Floats{0.25f, 0.125f, 0, 0.5f}, {INFINITY, INFINITY, INFINITY, 4});
    disparity.background_from.reset();
    disparity.missing = 0; // which is infinity if it is not said
    check(disparity, Floats{0.25f, 0.125f, 0, 0.5f}, {8, 16, NAN, 4});

    Camera backwards = with(wide, 6);
    backwards.encoding = Encoding::view_z;
    backwards.scale = -2;
    check(backwards, Floats{-INFINITY, -4, 0, 4, INFINITY, -1e10f}, {INFINITY, 8, NAN, NAN, NAN, 2e10f});
    check(backwards, Floats{-INFINITY, -4, 0, 4, INFINITY, NAN}, {INFINITY, 8, NAN, NAN, NAN, NAN}, Background::decode);
    backwards.background_from = -1000;
    check(backwards, Floats{-INFINITY, -4, -1000, -5000, -999, 1000}, {INFINITY, 8, INFINITY, INFINITY, 1998, NAN});
    backwards.encoding = Encoding::inverse; // z = -2/v
    backwards.background_from = -0.25;
    check(backwards, Floats{-0.25f, -0.125f, 0, -0.5f, 0.5f, 1e9f},
          {INFINITY, INFINITY, INFINITY, 4, INFINITY, INFINITY});
    backwards.background_from.reset();
    check(backwards, Floats{-0.25f, -0.125f, 0, -0.5f, 0.5f, 1e9f}, {8, 16, INFINITY, 4, NAN, NAN});
    Camera kinect = with(wide, 6); // its raw values, z = 351.3/(1092.5 - v)
    kinect.encoding = Encoding::inverse;
    kinect.scale = -351.3;
    kinect.offset = -1092.5;
    const Floats of_raw = stability::decoded(kinect, Codes{0, 1091, 1092, 1093, 2047, 600}, Storage::uint16);
    CHECK(of_raw[5] == Approx(351.3 / 492.5));
    CHECK(of_raw[2] == Approx(702.6));
    CHECK((std::isnan(of_raw[3]) && std::isnan(of_raw[4])));

    Camera reversed = with(perspective(1.0, 1.5, {0.5, infinity, DepthOrder::reversed}, Convention::direct3d()), 3);
    reversed.background_from = 0.0625;
    check(reversed, Floats{0.0625f, 0.03f, 0.125f}, {INFINITY, INFINITY, 4});

    Camera half = with(wide, 3);
    half.encoding = Encoding::view_z;
    half.background_from = 1e10;
    check(half, Codes{0x7bff, 0x7bfe, 0x4000}, {INFINITY, 65472, 2}, Background::inf, Storage::float16);

    // -0 is 0, whichever of them the camera says.
    for (const double zero : {0.0, -0.0})
        for (const bool is_missing : {true, false}) {
            Camera counted = with(wide, 3);
            counted.encoding = Encoding::view_z;
            (is_missing ? counted.missing : counted.background) = zero;
            const float none = is_missing ? NAN : INFINITY;
            check(counted, Floats{0.0f, -0.0f, 2.0f}, {none, none, 2});
            check(counted, Codes{0, 0x8000, 0x4000}, {none, none, 2}, Background::inf, Storage::float16);
        }

    const Codes codes{0, 1000, 65535};
    Camera millimetres = with(wide, 3);
    millimetres.encoding = Encoding::view_z;
    millimetres.scale = 0.001;
    millimetres.missing = 0;
    millimetres.background_from = 65000;
    check(millimetres, codes, {NAN, 1, INFINITY}, Background::inf, Storage::uint16);
    millimetres.missing = 65535; // which is also beyond the background's first value
    check(millimetres, codes, {NAN, 1, NAN}, Background::inf, Storage::uint16);
    millimetres.missing = 0;
    millimetres.background = 0;
    CHECK_THROWS_AS(depth_form(millimetres, Storage::uint16), std::invalid_argument); // a value means one thing
}

// The bound where it is hardest to keep: of many pixels, those whose stored value makes the sum of an oblique form all
// but vanish. There κ·ε is most of what is allowed.
TEST_CASE("linearize: sums that all but vanish are within their condition's bound", "[linearize][exact]") {
    std::mt19937 random(2718);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (const Arithmetic arithmetic : oracle::arithmetics()) {
        oracle::Worst worst;
        oracle::Faults faults;
        for (int i = 0; i < 12; ++i) {
            const Eigen::Vector4d plane(unit(random), unit(random), -1, -2.5 + unit(random));
            const Subject subject =
                i % 2 == 0
                    ? oracle::named(
                          with_oblique_near_plane(oracle::from_edges({-0.07, 0.06, -0.04, 0.05}, {0.1, 50}), plane),
                          "oblique")
                    : oracle::named(with_oblique_near_plane(oracle::from_orthographic({-2, 3, -2, 3}, {-3, 50}), plane),
                                    "oblique orthographic");
            const oracle::Truth truth(subject, Storage::float32);
            const Form form = depth_form(subject.camera).form;
            const oracle::Promise promise = oracle::promise(form, arithmetic);
            const int width = 16384, height = 8, top = 1000 + 1200 * i;
            std::vector<float> values, depth(static_cast<std::size_t>(width * height));
            const auto& varying = i % 2 == 0 ? truth.quotient().denominator : truth.quotient().numerator;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const auto rest = varying.low + varying.x * (x + 0.5) + varying.y * (top + y + 0.5) + varying.one;
                    values.push_back(static_cast<float>(-rest / (varying.high - varying.low)));
                }
            const Image image =
                Image::from_host(oracle::device(arithmetic), Element::f32, values.data(), {width, height});
            linearize({image, subject.camera, Storage::float32, 0, top}, {Background::decode})
                .image.download(depth.data());
            for (std::size_t at = 0; at < depth.size(); ++at) {
                const auto column = static_cast<double>(at % width), row = static_cast<double>(at / width);
                if (truth.in_range(static_cast<double>(values[at])))
                    faults.add(oracle::judge(subject, truth, form, promise, static_cast<double>(values[at]),
                                             column + 0.5, top + row + 0.5, depth[at], worst));
            }
        }
        worst.print(std::string("vanishing sums, ") + oracle::name(arithmetic));
        CHECK(worst.checked > 10000);
        CHECK(faults.text() == "");
    }
}

// By hand: the point of pixel (x, y) at depth z is z ((x - cx) / fx, (y - cy) / fy, 1), and its length is the distance. What is
// stored as such a distance is that distance.
TEST_CASE("linearize: distance along the ray is within its bound, of every encoding", "[linearize][exact]") {
    constexpr int width = 61, height = 33;
    const Intrinsics lens{.fx = 40, .fy = 44.5, .cx = 27.3, .cy = 15.1, .width = width, .height = height};
    std::mt19937 random(11);
    std::uniform_real_distribution<float> unit(0.01f, 0.99f);
    for (const Arithmetic arithmetic : oracle::arithmetics())
        for (const Encoding encoding :
             {Encoding::window, Encoding::view_z, Encoding::ray_distance, Encoding::linear, Encoding::logarithmic,
              Encoding::exponential, Encoding::median, Encoding::inverse, Encoding::inverse_range}) {
            Camera camera;
            camera.projection = perspective(lens, {0.1, 1e4});
            camera.width = width, camera.height = height;
            camera.encoding = encoding;
            camera.near_plane = 0.1, camera.far_plane = 1e4, camera.median = 3;
            camera.scale = is_metric(encoding) ? 0.37 : 1;
            std::vector<float> stored(width * height), got(stored.size());
            for (float& value : stored)
                value = unit(random);
            stored[5] = std::numeric_limits<float>::quiet_NaN();
            if (is_metric(encoding) && encoding != Encoding::inverse)
                stored[6] = static_cast<float>(infinity);
            linearize(
                {Image::from_host(oracle::device(arithmetic), Element::f32, stored.data(), {width, height}), camera},
                {.as = Along::ray})
                .image.download(got.data());
            double worst = 0;
            for (std::size_t i = 0; i < stored.size(); ++i) {
                if (i == 5 || std::isinf(stored[i])) {
                    CHECK((i == 5 ? std::isnan(got[i]) : got[i] == stored[i]));
                    continue;
                }
                const long double x = static_cast<long double>(i % width) + 0.5L,
                                  y = static_cast<long double>(i / width) + 0.5L, v = stored[i];
                const long double z = view_depth(camera, Storage::float32, static_cast<double>(x),
                                                 static_cast<double>(y), static_cast<double>(v));
                const long double expected = encoding == Encoding::ray_distance
                                                 ? static_cast<long double>(0.37) * v
                                                 : z * std::hypot((x - static_cast<long double>(27.3)) / 40,
                                                                  (y - static_cast<long double>(15.1)) / 44.5L, 1.0L);
                const float nearest = static_cast<float>(expected);
                const double ulp = static_cast<double>(std::nextafter(nearest, 1e30f) - nearest);
                worst =
                    std::max(worst, static_cast<double>(std::abs(expected - static_cast<long double>(got[i]))) / ulp);
            }
            std::printf("linearize, %s as distance along the ray, %s: %.3f ulp\n", to_string(encoding),
                        oracle::name(arithmetic), worst);
            const bool exponential = encoding == Encoding::logarithmic || encoding == Encoding::exponential;
            CHECK(worst <= linearize_ulp_ray_distance + (exponential ? linearize_ulp_exponential : 0));
        }
}
