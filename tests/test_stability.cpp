// Stored values at the ends of what can be decoded.

#include "catch.hpp"
#include "stability.hpp"

using namespace fathom;
using namespace fathom::stability;

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
