// How far ssao looks. That a tile with so much around it has the bits of the whole stands in test_contract.cpp.
#include "catch.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

TEST_CASE("tiles: how far ssao looks grows with the nearness of surfaces, up to the whole image", "[tiles]") {
    constexpr int width = 430, height = 410;
    constexpr double radius = 0.15; // 16 pixels at a depth of 3.8
    Camera camera{.projection = perspective(1.0, 1.2 * width / height, {0.5, 100}),
                  .width = width,
                  .height = height,
                  .encoding = Encoding::view_z};
    const Tile tile(camera, Storage::float32, {0, 0, width, height});
    const SsaoOptions options;
    CHECK(reach(tile, radius, options, 3.8).rows < 180);
    Reach last;
    for (const double depth : {100.0, 10.0, 2.0, 0.5, 0.16, 0.1}) {
        const Reach found = reach(tile, radius, options, depth);
        CHECK(found.columns >= last.columns);
        CHECK(found.rows >= last.rows);
        last = found;
    }
    CHECK(last.columns == width);
    CHECK(last.rows == height);
    CHECK_THROWS_WITH(reach(tile, radius, options, -1), "nearest = -1 does not lie before the camera");
    camera.projection = orthographic({-2, 2, -2, 2}, {0.5, 100});
    const Tile other(camera, Storage::float32, {0, 0, width, height});
    CHECK(reach(other, radius, options, 1).rows == reach(other, radius, options, 50).rows);
    CHECK_THROWS_AS(reach(tile, 0, options, 1), std::invalid_argument);
}
