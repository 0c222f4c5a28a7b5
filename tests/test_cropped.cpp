// The camera of a part of an image: a point is seen at the same place of the image, counted from the part's first pixel, and
// its stored value is the same.

#include "catch.hpp"
#include "seen.hpp"

#include <fathom/camera.hpp>

using namespace fathom;
using namespace fathom::seen;

namespace {

// Two products of a row and a point and a few sums in long double, of numbers below 2⁴ of the image's size.
constexpr Real place_tolerance = 0x1p-58L;

std::vector<Camera> cameras() {
    std::vector<Camera> all;
    for (const Convention& convention : {Convention::opengl(), Convention::direct3d(), Convention::vulkan(),
                                         Convention{ClipZ::zero_to_one, ClipY::down, ViewAxes::opencv}})
        for (const Rows rows : {Rows::top_down, Rows::bottom_up}) {
            const Projection centred = perspective(1.0, 2.0, {0.5, 100}, convention),
                             off_centre = perspective(FrustumEdges{-0.3, 0.5, -0.1, 0.4}, {0.5, 100}, convention),
                             parallel = orthographic({-3, 5, -2, 4}, {1, 50}, convention);
            Eigen::Matrix4d tilted = centred.matrix.cast<double>();
            tilted(3, 0) = 0.05;
            tilted(3, 1) = -0.02;
            for (const Projection& projection : {centred, off_centre, parallel, from_matrix(tilted, convention)}) {
                all.push_back(seen::camera_of(projection));
                all.back().rows = rows;
            }
        }
    return all;
}

} // namespace

TEST_CASE("cropped: a part of an image, or more than it, shows a point at the same place and depth", "[cropped]") {
    struct Part {
        int x, y, width, height;
    };
    std::mt19937 random(5);
    std::uniform_real_distribution<double> anywhere(-1, 1), far(2, 40);
    Real worst = 0;
    for (const Camera& camera : cameras())
        for (const Part& part : {Part{0, 0, 64, 32}, Part{-7, -3, 80, 40}, Part{10, 5, 1, 1}, Part{63, 31, 20, 9},
                                 Part{100, -90, 3, 500}}) {
            const Camera crop = cropped(camera, part.x, part.y, part.width, part.height);
            CHECK((crop.width == part.width && crop.height == part.height));
            CHECK(crop.projection.third_row().row == camera.projection.third_row().row);
            for (int i = 0; i < 20; ++i) {
                const Real depth = far(random);
                const Point point = turned(camera.projection.convention.view_axes,
                                           Point(anywhere(random) * depth, anywhere(random) * depth, -depth));
                const Place whole = place_of(camera, point), seen = place_of(crop, point);
                const Real size = std::max({std::abs(whole.x), std::abs(whole.y), Real{600}});
                worst = std::max(
                    {worst, std::abs(seen.x + part.x - whole.x) / size, std::abs(seen.y + part.y - whole.y) / size});
                REQUIRE(seen.stored == whole.stored);
            }
        }
    std::cout << "cropped: places off by at most " << worst << " of the image's size, allowed " << place_tolerance
              << "\n";
    CHECK(worst <= place_tolerance);
}

TEST_CASE("cropped: the whole image is the same camera; nothing is no camera", "[cropped]") {
    const Camera camera = seen::camera_of(perspective(1.0, 2.0, {0.5, 100}));
    CHECK(cropped(camera, 0, 0, 64, 32).projection.matrix == camera.projection.matrix);
    CHECK_THROWS_AS(cropped(camera, 0, 0, 0, 32), std::invalid_argument);
    CHECK_THROWS_AS(cropped(Camera{}, 0, 0, 4, 4), std::invalid_argument);
}
