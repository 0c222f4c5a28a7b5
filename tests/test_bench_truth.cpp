// The truth that the bench compares with: a lens in a scene whose blur is known.

#include "case.hpp"
#include "catch.hpp"
#include "judge.hpp"
#include "lens_blur.hpp"
#include "lens_truth.hpp"

using namespace fathom;

namespace {

// A wall that faces the camera, dark to the left of x = 0.
bench::View wall(bool is_orthographic, double near = 0.1, double far = 100) {
    const oracle::Subject camera = is_orthographic ? oracle::from_orthographic({-8, 8, -4.5, 4.5}, {near, far})
                                                   : oracle::from_field_of_view(0.9, 16.0 / 9, {near, far});
    return {"wall", {scene::Plane{{0, 0, -10}, {0, 0, 1}}}, oracle::named(camera, "wall", 160, 90), 100, true};
}

// Worst difference from a half-plane blurred by a circle of this diameter, of pixels as wide as a pixel is.
double worst_edge_error(bool is_orthographic, double diameter) {
    const bench::View view = wall(is_orthographic);
    const double focus = 5, away = 10;
    const double k = is_orthographic ? diameter * focus / (away - focus) : diameter / (1 - focus / away);
    const CircleOfConfusion lens = is_orthographic ? CircleOfConfusion{k, static_cast<long double>(k / focus), 0, true}
                                                   : CircleOfConfusion{k, static_cast<long double>(k * focus)};
    CHECK(static_cast<double>(coc_at(lens, away)) == Approx(diameter));
    const bench::LensTruth truth(view, lens);
    const double bright = truth.at(159, 20)[0], dark = truth.at(0, 20)[0];
    CHECK(std::abs(bright - dark) > 0.15);
    double worst = 0;
    for (int x = 60; x < 100; ++x) {
        double share = 0; // of the pixel's width
        for (int i = 0; i < 64; ++i)
            share += lens_blur::half_plane((x + (i + 0.5) / 64 - 80) / (diameter / 2)) / 64;
        const double got = (truth.at(x, 20)[0] - dark) / (bright - dark);
        worst = std::max(worst, std::abs(got - share));
    }
    return worst;
}

} // namespace

TEST_CASE("bench: the lens through a scene blurs an edge as the closed form does", "[bench]") {
    // An edge cuts about √N of the cells that N rays stand for, whose errors add up like random ones: N^(1/4) rays of N.
    const double allowed = 1.5 * std::pow(1024, -0.75);
    for (const bool is_orthographic : {false, true})
        for (const double diameter : {2.0, 12.0, 30.0}) {
            const double worst = worst_edge_error(is_orthographic, diameter);
            std::printf("%s, circle of %.0f pixels: worst %.5f of the step (allowed %.5f)\n",
                        is_orthographic ? "orthographic rays" : "perspective", diameter, worst, allowed);
            CHECK(worst <= allowed);
        }
}

// The town's horizon once showed the lens an infinite ground, of which the picture ends at the far plane.
TEST_CASE("bench: the lens sees what the picture does, and nothing beyond the near and far planes", "[bench]") {
    constexpr double inf = std::numeric_limits<double>::infinity();
    for (const bool is_orthographic : {false, true}) {
        const CircleOfConfusion lens = is_orthographic ? CircleOfConfusion{20, 4, 0, true} : CircleOfConfusion{20, 100};
        for (const auto& [near, far, is_there] : {std::tuple{0.1, 9.99, false},
                                                  {0.1, 10.01, true},
                                                  {9.99, 30.0, true},
                                                  {10.01, 30.0, false},
                                                  {0.1, inf, true}}) {
            if (is_orthographic && far == inf)
                continue;
            const bench::View view = wall(is_orthographic, near, far);
            INFO((is_orthographic ? "orthographic rays, " : "perspective, ") << near << " to " << far);
            const Eigen::Vector3d color = bench::LensTruth(view, lens).at(120, 30);
            CHECK(((color - bench::sky_color()).norm() > 0.1) == is_there);
            CHECK((bench::picture_of(view)[3 * (30 * 160 + 120) + 2] != static_cast<float>(bench::sky_color()[2])) ==
                  is_there);
        }
    }
}
