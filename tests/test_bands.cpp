// Operations in bands of rows: the bands make every row once, and what lies between the passes does not grow with the image.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "operations/bands.hpp"
#include "operations/dof/dof.hpp"
#include "runtime/state.hpp"
#include "ssao_call.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::images;

namespace {

// A floor with steps and walls of several sizes, as metric depth: the nearest surface is 3 m away.
float depth_at(int x, int y) {
    const int step = x / 37 % 3 + y / 29 % 2 + (x / 211 + y / 97) % 4;
    return 3.0f + 0.02f * static_cast<float>(step) + 1e-4f * static_cast<float>((x * 7 + y * 13) % 11);
}

// An image that large, with single invalid pixels, in metres and in millimetres.
struct Steps {
    Camera camera;
    std::vector<float> metres;
    std::vector<std::uint16_t> millimetres;

    Steps(int width, int height) {
        camera.width = width;
        camera.height = height;
        camera.projection = perspective(1.0, 1.0 * width / height, {0.1, 100});
        camera.encoding = Encoding::view_z;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const bool hole = (x * 31 + y * 17) % 997 == 0;
                metres.push_back(hole ? std::nanf("") : depth_at(x, y));
                millimetres.push_back(hole ? 0 : static_cast<std::uint16_t>(std::lround(1000 * depth_at(x, y))));
            }
        }
    }

    StoredDepth stored(const Device& device, Storage storage) const {
        const Layout layout{camera.width, camera.height};
        if (storage == Storage::float32)
            return {Image::from_host(device, Element::f32, metres.data(), layout), camera};
        Camera scaled = camera;
        scaled.scale = 0.001;
        return {Image::from_host(device, Element::u16, millimetres.data(), layout), scaled, storage};
    }
};

} // namespace

TEST_CASE("bands make every row once and read what lies within their halo", "[bands]") {
    for (const auto& [rows, halo, made_bytes, least] :
         {std::tuple{1, 0, 0, 1}, {2, 1, 0, 1}, {7, 5, 0, 2}, {100, 5, 0, 1}, {1001, 1, 0, 1}, {540, 36, 160, 18}}) {
        for (const std::size_t budget : {std::size_t{1}, std::size_t{640}, std::size_t{6400}, std::size_t{1} << 40}) {
            const auto bytes = [made_bytes = made_bytes](int read, int made) {
                return static_cast<std::size_t>(64 * read + made_bytes * made);
            };
            int made = 0;
            const std::vector<Band> all = bands({0, rows, rows, {halo}, bytes, least}, budget);
            for (const Band& band : all) {
                REQUIRE(band.begin == made);
                REQUIRE(band.end > band.begin);
                made = band.end;
                CHECK(band.first == std::max(band.begin - halo, 0));
                CHECK(band.last == std::min(band.end + halo, rows));
                const int lowest = std::max(least, (band.last - band.first - (band.end - band.begin)) / 8);
                CHECK((bytes(band.last - band.first, band.end - band.begin) <= budget ||
                       band.end - band.begin <= lowest));
                CHECK((band.end - band.begin >= least || band.end == rows));
            }
            CHECK(made == rows);
            CHECK((all.size() == 1 || bytes(rows, rows) > budget));
            CHECK(bands({0, rows, rows, std::vector<int>(static_cast<std::size_t>(rows), halo), bytes, least}, budget)
                      .size() == all.size());
        }
    }
}

TEST_CASE("bands: the budget that is named is the smallest one that works", "[bands]") {
    constexpr std::size_t mebibyte = std::size_t{1} << 20;
    // Low bands take more than some higher ones do.
    const auto bytes = [](int read, int made) {
        return static_cast<std::size_t>(read + (made < 100 ? 90 : 0)) * mebibyte;
    };
    const RowNeeds rows{0, 1000, 1000, {40}, bytes, 64};
    std::size_t smallest = 0;
    const auto works = [&](std::size_t budget) {
        try {
            bands(rows, budget, "this");
            return true;
        } catch (const Error& error) {
            std::size_t named = 0;
            REQUIRE(std::sscanf(error.what(), "this needs a memory budget of %zu MiB", &named) == 1);
            if (smallest == 0)
                smallest = named * mebibyte;
            CHECK(named * mebibyte == smallest);
            return false;
        }
    };
    CHECK(!works(1));
    CHECK(works(smallest));
    CHECK(!works(smallest - 1));
    CHECK(bytes(64 + 80, 64) > smallest);
}

namespace {

// What the pool of scratch memory has grown to.
double scratch_bytes(const Device& device) {
    double bytes = 0;
    for (const runtime::ScratchBuffer& each : device.state().scratch)
        bytes += static_cast<double>(each.size);
    return bytes;
}

// A picture whose circles go from -`most` to `most`, in steps and slopes, with a few invalid pixels and highlights.
struct Blurred {
    std::vector<float> depth, rgb;
    StoredDepth stored;
    Image color;
    static constexpr CircleOfConfusion lens{.k = 1000, .g = 1000};

    Blurred(const Device& device, int width, int height, double most, unsigned seed) {
        Camera camera{.projection = perspective(1.0, 1.0 * width / height, {0.01, 100}),
                      .width = width,
                      .height = height,
                      .encoding = Encoding::view_z};
        std::minstd_rand random(seed);
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const int which = (x / 70 + y / 50) % 4;
                const double slope = 1.0 * y / height, circle = which == 0   ? most * (0.4 * slope - 1)
                                                                : which == 1 ? most * slope
                                                                : which == 2 ? most * (x % 500) / 500
                                                                             : 0;
                const bool hole = (x * 31 + y * 17) % 997 == 0;
                depth.push_back(hole ? std::nanf("") : static_cast<float>(lens.g / (lens.k - circle)));
                for (int k = 0; k < 3; ++k)
                    rgb.push_back(static_cast<float>(random() % 1024) / 1024.0f);
                if ((x * 13 + y * 7) % 4999 == 0)
                    rgb.back() = 1e4f;
            }
        }
        stored = {Image::from_host(device, Element::f32, depth.data(), {width, height}), camera};
        color = Image::from_host(device, Element::f32, rgb.data(), {width, height, 3});
    }
};

} // namespace
