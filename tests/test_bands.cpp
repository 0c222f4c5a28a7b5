// Operations in bands of rows: the bands make every row once, results keep their bits, and what lies between the passes does not
// grow with the image.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "operations/bands.hpp"
#include "runtime/state.hpp"
#include "ssao_call.hpp"

#include <fathom/fathom.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <utility>
#include <vector>

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
    for (const int rows : {1, 2, 7, 100, 1001}) {
        for (const int halo : {0, 1, 5}) {
            for (const std::size_t budget :
                 {std::size_t{1}, std::size_t{640}, std::size_t{6400}, std::size_t{1} << 40}) {
                constexpr std::size_t row_bytes = 64;
                int made = 0;
                for (const Band& band : bands(rows, halo, row_bytes, budget)) {
                    REQUIRE(band.begin == made);
                    REQUIRE(band.end > band.begin);
                    made = band.end;
                    CHECK(band.first == std::max(band.begin - halo, 0));
                    CHECK(band.last == std::min(band.end + halo, rows));
                    const auto reads = static_cast<std::size_t>(band.last - band.first);
                    CHECK((reads * row_bytes <= budget || band.end == band.begin + 1));
                }
                CHECK(made == rows);
            }
        }
    }
}

TEST_CASE("ssao: bands keep the bits", "[ssao][bands]") {
    // So wide that planes are made in two bands and sums in five; a strip of rows takes one of each.
    constexpr int width = 8192, height = 1100, strip = 180, halo = 24;
    const Device device = oracle::device(Arithmetic::fp64);
    const Steps steps(width, height);
    for (const Storage storage : {Storage::float32, Storage::uint16}) {
        const StoredDepth stored = steps.stored(device, storage);
        SsaoCall options;
        options.radius = 0.02; // 10 pixels at most
        options.quality = Quality::fast;
        options.confidence = true;
        const Occlusion whole = ssao(stored, options);
        for (int y = 0; y < height; y += strip) {
            const int rows = std::min(strip, height - y), first = std::max(y - halo, 0),
                      last = std::min(y + rows + halo, height);
            SsaoCall part = options;
            part.region = Region{0, y - first, width, rows};
            const Occlusion piece = ssao(stored.region(0, first, width, last - first), part);
            INFO("rows from " << y << " on");
            CHECK(same_bits(floats(piece.visibility), floats(whole.visibility.region(0, y, width, rows))));
            CHECK(same_bits(floats(piece.confidence), floats(whole.confidence.region(0, y, width, rows))));
        }
        const std::vector<float> visible = floats(whole.visibility);
        CHECK(std::count_if(visible.begin(), visible.end(), [](float v) { return v < 0.9f; }) > width);
    }
}

TEST_CASE("ssao: what lies between its passes at 7680 x 4320", "[ssao][bands][slow]") {
    constexpr int width = 7680, height = 4320;
    constexpr double most = 500e6; // bytes, of scratch and tables
    const Device device = Device::open("cpu");
    const Steps steps(width, height);
    const StoredDepth stored = steps.stored(device, Storage::float32);
    SsaoCall options;
    options.radius = 0.1;
    options.quality = Quality::fast;
    const Occlusion done = ssao(stored, options);
    device.finish();
    CHECK(done.visibility.width() == width);
    double bytes = 0;
    for (const runtime::ScratchBuffer& each : device.state().scratch)
        bytes += static_cast<double>(each.size);
    std::printf("scratch at %d x %d: %.0f MB, %.1f bytes a pixel\n", width, height, bytes / 1e6,
                bytes / (1.0 * width * height));
    CHECK(bytes < most);
}
