// Frames that are larger than their results: means against plain loops in double, and a camera whose pixels see the same.
#include "catch.hpp"
#include "lenses.hpp"
#include "test_device.hpp"

#include <fathom/lens.hpp>
#include <fathom/pixel_rays.hpp>
#include <fathom/supersampled.hpp>

#include <Eigen/Core>

#include <limits>
#include <random>

using namespace fathom;

namespace {

template <typename T>
void check_means(Element element, int channels, int factor, bool has_nan, bool directions = false) {
    constexpr int width = 13, height = 9;
    const auto across = static_cast<std::size_t>(width * factor * channels);
    std::mt19937 random(static_cast<unsigned>(channels + 10 * factor));
    std::uniform_real_distribution number(std::is_integral_v<T> ? 0.0 : -1.0, std::is_integral_v<T> ? 250.0 : 1.0);
    std::vector<T> large(across * height * static_cast<std::size_t>(factor));
    for (std::size_t i = 0; i < large.size(); ++i)
        large[i] = has_nan && i % 7 < 3 ? static_cast<T>(NAN) : static_cast<T>(number(random));
    const Device device = test_device();
    const Image from = Image::from_host(device, element, large.data(), {width * factor, height * factor, channels});
    const Image small(device, element, {width, height, channels});
    average_squares(from, small, directions);
    std::vector<T> got(static_cast<std::size_t>(width * height * channels));
    small.download(got.data());
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            std::vector<double> expected;
            for (int c = 0; c < channels; ++c) {
                double sum = 0;
                int count = 0;
                for (int j = 0; j < factor; ++j)
                    for (int i = 0; i < factor; ++i) {
                        const double v =
                            static_cast<float>(large[static_cast<std::size_t>(y * factor + j) * across +
                                                     static_cast<std::size_t>((x * factor + i) * channels + c)]);
                        if (!std::isnan(v)) {
                            sum += v;
                            ++count;
                        }
                    }
                expected.push_back(directions ? sum : sum / count); // NaN of none
            }
            const double length = std::hypot(expected[0], directions ? expected[1] : 0, directions ? expected[2] : 0);
            for (int c = 0; c < channels; ++c) {
                const double is = static_cast<float>(got[static_cast<std::size_t>((y * width + x) * channels + c)]),
                             must = expected[static_cast<std::size_t>(c)] / (directions ? length : 1);
                const double step = element == Element::f32   ? 0x1p-24 * std::abs(must)
                                    : element == Element::f16 ? 0x1p-11 * std::abs(must)
                                                              : 0.5;
                if (std::isnan(must) ? !std::isnan(is) : !(std::abs(is - must) <= (directions ? 4 : 1.0001) * step))
                    FAIL("pixel " << x << ", " << y << ": " << is << ", not " << must);
            }
        }
}

} // namespace

TEST_CASE("supersampled: means are those of doubles, and leave out what is no number") {
    for (const int factor : {1, 2, 3, 4})
        for (const int channels : {1, 3, 4}) {
            check_means<float>(Element::f32, channels, factor, false);
            check_means<float>(Element::f32, channels, factor, true);
            check_means<Eigen::half>(Element::f16, channels, factor, true);
            check_means<std::uint8_t>(Element::u8, channels, factor, false);
            check_means<std::uint16_t>(Element::u16, channels, factor, false);
        }
    check_means<float>(Element::f32, 3, 3, false, true);
}

TEST_CASE("supersampled: directions that cancel are 0, and those that are none leave none") {
    const float none = NAN;
    const std::vector<float> large{1, 0, 0, -1, 0, 0, none, none, none, none, none, none, //
                                   0, 0, 0, 0,  0, 0, none, none, none, none, none, none};
    const Device device = test_device();
    const Image small(device, Element::f32, {2, 1, 3});
    average_squares(Image::from_host(device, Element::f32, large.data(), {4, 2, 3}), small, true);
    std::vector<float> got(6);
    small.download(got.data());
    for (std::size_t i = 0; i < 3; ++i) {
        CHECK(got[i] == 0);
        CHECK(std::isnan(got[3 + i]));
    }
}

TEST_CASE("supersampled: the large camera's pixels see what the small one's do, through any lens") {
    std::vector<Camera> cameras(1);
    cameras.front().projection = perspective(1.1, 4.0 / 3, {0.1, 100});
    cameras.front().width = 64;
    cameras.front().height = 48;
    for (const auto& [name, camera] : lens_subjects())
        if (camera.lens && !camera.lens->map)
            cameras.push_back(camera);
    CHECK(cameras.size() > 10);
    for (const Camera& camera : cameras)
        for (const int factor : {2, 3}) {
            const Camera large = supersampled(camera, factor);
            REQUIRE(large.width == factor * camera.width);
            const PixelRays rays(camera), fine(large);
            for (int y = 0; y <= camera.height; y += camera.height / 8)
                for (int x = 0; x <= camera.width; x += camera.width / 8) {
                    const auto ray = rays.ray_of(x, y), same = fine.ray_of(factor * x, factor * y);
                    REQUIRE(ray.has_value() == same.has_value());
                    if (ray)
                        CHECK((*ray - *same).norm() < 1e-12);
                }
        }
}

TEST_CASE("supersampled: lengths in pixels grow, and what does not fit is refused") {
    LensArguments lens;
    lens.circle = {3, 5};
    lens.blur_px = 7;
    lens.focus_at = LensArguments::Pixel{4, 1};
    const LensArguments large = supersampled(lens, 3);
    CHECK((*large.circle)[1] == 15);
    CHECK(*large.blur_px == 21);
    CHECK(large.focus_at->x == 13); // the middle of its square
    CHECK(large.focus_at->y == 4);

    const Device device = test_device();
    const auto image = [&](int width, int height, int channels, Element element = Element::f32) {
        return Image(device, element, {width, height, channels});
    };
    CHECK_THROWS_WITH(average_squares(image(8, 8, 3), image(4, 3, 3)), ContainsSubstring("whole number of times"));
    CHECK_THROWS_WITH(average_squares(image(8, 8, 3), image(4, 2, 3)), ContainsSubstring("whole number of times"));
    CHECK_THROWS_WITH(average_squares(image(8, 8, 3), image(4, 4, 1)), ContainsSubstring("number of channels"));
    CHECK_THROWS_WITH(average_squares(image(8, 8, 1), image(4, 4, 1), true), ContainsSubstring("3 channels"));
    CHECK_THROWS_WITH(average_squares(image(8, 8, 1, Element::u32), image(4, 4, 1, Element::u32)),
                      ContainsSubstring("32-bit"));
    CHECK_THROWS_WITH(average_squares({}, image(4, 4, 1)), ContainsSubstring("both images"));
    CHECK_THROWS_WITH(supersampled(Camera{}, 5), ContainsSubstring("1 to 4"));
    Camera mapped;
    mapped.lens = lens_of_rays({2, 1, {0, 0, 1, 0, 0, 1}});
    CHECK_THROWS_WITH(supersampled(mapped, 2), ContainsSubstring("map of rays"));
}
