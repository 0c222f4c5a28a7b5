// Holes in depth, pixels that do not count, and foregrounds that grow: against what hands and brute force make of them.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"

#include <fathom/linearize.hpp>

using namespace fathom;

TEST_CASE("fill_invalid: a hole has the farther depth beside it, and a row of holes that above or below",
          "[linearize]") {
    Camera camera;
    camera.projection = perspective(1.0, 5.0 / 4, {0.5, 100});
    camera.width = 5, camera.height = 4;
    camera.encoding = Encoding::view_z;
    camera.scale = 0.001;
    camera.missing = 0;
    std::vector<std::uint16_t> codes{0, 0,    1000, 0, 3000, // from one side; between two the farther
                                     0, 0,    0,    0, 0,    // no depth: as above or below, the farther
                                     7, 2000, 0,    0, 500,  // before a nearer one
                                     9, 9,    9,    9, 9};
    const std::vector<std::uint16_t> expected{1000, 1000, 1000, 3000, 3000, 1000, 2000, 2000, 3000, 3000,
                                              7,    2000, 2000, 2000, 500,  9,    9,    9,    9,    9};
    const Device device = oracle::device();
    const StoredDepth stored{Image::from_host(device, Element::u16, codes.data(), {5, 4}), camera, Storage::uint16};
    const auto codes_of = [](const Image& image) {
        std::vector<std::uint16_t> found(20);
        image.download(found.data());
        return found;
    };
    CHECK(codes_of(fill_invalid(stored).image) == expected);
    const Image around(device, Element::u16, {8, 6}), within = around.region(2, 1, 5, 4);
    fill_invalid(stored, within);
    CHECK(codes_of(within) == expected);
    fill_invalid(stored, stored.image);
    CHECK(codes_of(stored.image) == expected);
    CHECK_THROWS_AS(fill_invalid(stored, Image(device, Element::f32, {5, 4})), std::invalid_argument);
}

// The oracle: what each storage decodes to without a mask, and NaN where the mask is not 0.
TEST_CASE("ignore_pixels: masked pixels are invalid and all others keep their bits, in every storage", "[linearize]") {
    constexpr int width = 61, height = 33;
    constexpr std::size_t pixels = width * height;
    const Device device = oracle::device();
    std::mt19937 random(5);
    std::vector<std::uint8_t> mask(pixels);
    for (std::uint8_t& value : mask)
        value = random() % 3 == 0 ? static_cast<std::uint8_t>(random() % 255 + 1) : 0;
    const auto z_of = [](const StoredDepth& stored) { return images::floats(linearize(stored).image); };
    for (const Storage storage :
         {Storage::float32, Storage::float16, Storage::uint8, Storage::uint16, Storage::uint24, Storage::uint24_high,
          Storage::rgb8_red_low, Storage::rgb8_red_high, Storage::bgr8_red_low, Storage::bgr8_red_high})
        for (const bool names_missing : {false, true}) {
            INFO(to_string(storage) << (names_missing ? ", missing" : ""));
            Camera camera;
            camera.projection = perspective(1.0, 1.8, {0.5, 100});
            camera.width = width, camera.height = height;
            const bool is_float = storage == Storage::float32 || storage == Storage::float16;
            if (names_missing && !is_float)
                camera.missing = 0;
            const Element element = element_of(storage);
            const auto size = element_bytes(element) * static_cast<std::size_t>(channels_of(storage));
            std::vector<std::uint8_t> bytes(pixels * size);
            for (std::size_t i = 0; i < pixels; ++i) {
                const auto code = static_cast<std::uint32_t>(random() % 200); // some codes of 8 bits are left
                const std::uint32_t bits = storage == Storage::float32
                                               ? std::bit_cast<std::uint32_t>(static_cast<float>(code) / 200)
                                           : storage == Storage::float16     ? 0x3000 + code
                                           : storage == Storage::uint24_high ? code << 8
                                                                             : code;
                std::memcpy(&bytes[i * size], &bits, size);
            }
            const StoredDepth stored{
                Image::from_host(device, element, bytes.data(), {width, height, channels_of(storage)}), camera,
                storage};
            std::vector<float> expected = z_of(stored);
            for (std::size_t i = 0; i < pixels; ++i)
                if (mask[i] != 0)
                    expected[i] = std::numeric_limits<float>::quiet_NaN();
            const Image ignore = Image::from_host(device, Element::u8, mask.data(), {width, height});
            const auto alike = [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); };
            CHECK(std::ranges::equal(z_of(ignore_pixels(stored, ignore)), expected, alike));
            const std::vector<float> zeros(pixels, -0.0f);
            const Image none = Image::from_host(device, Element::f32, zeros.data(), {width, height});
            CHECK(std::ranges::equal(z_of(ignore_pixels(stored, none)), z_of(stored), alike));
        }
}

TEST_CASE("ignore_pixels: refuses a mask of another size, and integers that leave no code", "[linearize]") {
    const Device device = oracle::device();
    Camera camera;
    camera.projection = perspective(1.0, 1, {0.5, 100});
    camera.width = camera.height = 16;
    std::vector<std::uint8_t> codes(256), mask(256, 1);
    std::iota(codes.begin(), codes.end(), std::uint8_t{0});
    const StoredDepth stored{Image::from_host(device, Element::u8, codes.data(), {16, 16}), camera, Storage::uint8};
    const auto masked = [&](int width) {
        return ignore_pixels(stored, Image::from_host(device, Element::u8, mask.data(), {width, 16}));
    };
    CHECK_THROWS_AS(masked(8), std::invalid_argument);
    CHECK_THROWS_WITH(masked(16), ContainsSubstring("\"missing\""));
    codes[7] = 6; // one is left
    CHECK(masked(16).camera.missing == 7);
}

// The oracle: the least distance in double over all pixels whose centres are near enough, and whose value that is.
TEST_CASE("grow_foreground: a pixel takes the nearest surface within so many pixels, and regions agree",
          "[linearize]") {
    constexpr int width = 47, height = 29;
    const Device device = oracle::device();
    std::mt19937 random(11);
    for (const Storage storage : {Storage::float32, Storage::uint16, Storage::rgb8_red_low}) {
        Camera camera;
        camera.projection = perspective(1.0, static_cast<double>(width) / height, {0.5, 100});
        camera.width = width, camera.height = height;
        camera.encoding = Encoding::view_z;
        camera.scale = storage == Storage::float32 ? 1 : 0.001;
        camera.missing = 0;
        camera.background = storage == Storage::float32 ? INFINITY : 60000;
        const auto size = element_bytes(element_of(storage)) * static_cast<std::size_t>(channels_of(storage));
        std::vector<std::uint8_t> bytes(width * height * size);
        std::vector<double> z;
        for (std::size_t i = 0; i < width * height; ++i) {
            const bool is_hole = random() % 9 == 0, is_sky = random() % 5 == 0;
            const auto code = static_cast<std::uint32_t>(is_hole ? 0 : is_sky ? 60000 : random() % 50000 + 1);
            const float metres = is_sky ? INFINITY : static_cast<float>(code) * 0.001f;
            z.push_back(is_hole ? NAN : is_sky ? INFINITY : static_cast<double>(code));
            const std::uint32_t bits =
                storage == Storage::float32 ? std::bit_cast<std::uint32_t>(is_hole ? 0.0f : metres) : code;
            std::memcpy(&bytes[i * size], &bits, size);
        }
        const StoredDepth stored{
            Image::from_host(device, element_of(storage), bytes.data(), {width, height, channels_of(storage)}), camera,
            storage};
        const auto bytes_of = [&](const Image& image) {
            std::vector<std::uint8_t> found(static_cast<std::size_t>(image.width() * image.height()) * size);
            image.download(found.data());
            return found;
        };
        for (const int pixels : {0, 1, 2, 5}) {
            std::vector<std::uint8_t> expected = bytes;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const auto at = static_cast<std::size_t>(y * width + x);
                    double nearest = z[at];
                    for (int v = std::max(y - pixels, 0); v <= std::min(y + pixels, height - 1); ++v)
                        for (int u = std::max(x - pixels, 0); u <= std::min(x + pixels, width - 1); ++u) {
                            const auto other = static_cast<std::size_t>(v * width + u);
                            if (std::hypot(u - x, v - y) <= pixels && z[other] < nearest) {
                                nearest = z[other];
                                std::memcpy(&expected[at * size], &bytes[other * size], size);
                            }
                        }
                }
            INFO(to_string(storage) << ", " << pixels << " pixels");
            CHECK(bytes_of(grow_foreground(stored, pixels).image) == expected);
            const Image part = grow_foreground(stored.region(9, 6, 30, 20), pixels).image,
                        whole = grow_foreground(stored, pixels).image;
            const int in = pixels;
            CHECK(bytes_of(part.region(in, in, 30 - 2 * in, 20 - 2 * in)) ==
                  bytes_of(whole.region(9 + in, 6 + in, 30 - 2 * in, 20 - 2 * in)));
        }
        CHECK_THROWS_AS(grow_foreground(stored, most_grown_pixels + 1), std::invalid_argument);
        CHECK_THROWS_AS(grow_foreground(stored, -1), std::invalid_argument);
        CHECK_THROWS_AS(grow_foreground(stored, Image(device, Element::f32, {5, 4}), 1), std::invalid_argument);
    }
}

// An upsampled pixel lies between the depths within two pixels of the depth image, or is background or invalid as one of them is.
TEST_CASE("upsample_along_edges: random images stay among the depths around a pixel", "[linearize]") {
    constexpr unsigned images = 5000;
    constexpr double rounding = 0x1p-22; // of a mean of floats
    const Device device = oracle::device();
    std::mt19937 random(12);
    const auto real = [&](double least, double most) {
        return static_cast<float>(std::uniform_real_distribution(least, most)(random));
    };
    long outside = 0;
    for (unsigned n = 0; n < images; ++n) {
        const int width = 1 + static_cast<int>(random() % 9), height = 1 + static_cast<int>(random() % 7),
                  times = 1 + static_cast<int>(random() % 3), kinds = 1 + static_cast<int>(random() % 20);
        const Camera camera{.projection = perspective(1.0, 1.0 * width / height, {0.01, 100}),
                            .width = width,
                            .height = height,
                            .encoding = Encoding::view_z};
        std::vector<float> depth(static_cast<std::size_t>(width * height)),
            color(static_cast<std::size_t>(3 * width * height * times * times));
        for (float& z : depth) {
            const int kind = static_cast<int>(random() % 40);
            z = kind >= kinds ? real(0.1, 9) : kind % 4 == 0 ? INFINITY : kind % 4 == 1 ? real(1e-4, 1e4) : NAN;
        }
        for (float& value : color)
            value = random() % 50 == 0 ? 65504.0f : real(0, 1);
        const StoredDepth stored{Image::from_host(device, Element::f32, depth.data(), {width, height}), camera};
        const auto z_at = [&](int x, int y) {
            return depth[static_cast<std::size_t>(std::clamp(y, 0, height - 1) * width + std::clamp(x, 0, width - 1))];
        };

        const Image picture = Image::from_host(device, Element::f32, color.data(), {width * times, height * times, 3});
        const std::vector<float> fine = images::floats(upsample_along_edges(stored, picture).image);
        for (int y = 0; y < height * times; ++y)
            for (int x = 0; x < width * times; ++x) {
                double least = INFINITY, most = 0;
                bool background = false, invalid = false;
                for (int v = y / times - 2; v <= y / times + 2; ++v)
                    for (int u = x / times - 2; u <= x / times + 2; ++u) {
                        const float z = z_at(u, v);
                        background |= std::isinf(z);
                        invalid |= std::isnan(z);
                        if (std::isfinite(z)) {
                            least = std::min<double>(least, z);
                            most = std::max<double>(most, z);
                        }
                    }
                const double is = fine[static_cast<std::size_t>(y * width * times + x)];
                outside += std::isnan(is)   ? !invalid
                           : std::isinf(is) ? !background
                                            : is < least * (1 - rounding) || is > most * (1 + rounding);
            }
    }
    CHECK(outside == 0);
}
