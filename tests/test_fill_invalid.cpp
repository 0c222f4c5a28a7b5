// Holes in depth: each takes the farther of its two neighbours, by hand.

#include "catch.hpp"
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
