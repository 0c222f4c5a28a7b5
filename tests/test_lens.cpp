// Lenses: the thin-lens equations in their textbook form, inverses, refusals, and the limits between one kind and another.

#include "catch.hpp"

#include <fathom/lens.hpp>

using namespace fathom;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double rounding = 1e-14; // some roundings of a double: parameters are doubles, sums are long double

Camera perspective_camera(int width = 480, int height = 270, double slope_x = 0.5) {
    Camera camera;
    camera.projection =
        perspective(FrustumEdges{-slope_x, slope_x, -slope_x * height / width, slope_x * height / width}, {1, 100});
    camera.width = width;
    camera.height = height;
    return camera;
}

Camera orthographic_camera(double width_units = 12) {
    return {.projection = orthographic({0, width_units, -2, 7}, {-5, 100}), .width = 480, .height = 270};
}

double at(const CircleOfConfusion& circle, double z) {
    return static_cast<double>(coc_at(circle, z));
}

bool same(double a, double b, double relative = rounding) {
    return std::abs(a - b) <= relative * std::max(std::abs(a), std::abs(b));
}

// A ray through the edge of the aperture, followed to the sensor: image distances by 1/f = 1/z + 1/v.
double on_sensor_mm(double focal, double f_stop, double focus, double z) {
    const double sensor = 1 / (1 / focal - 1 / focus), image = 1 / (1 / focal - 1 / z);
    return focal / f_stop * (sensor - image) / image;
}

} // namespace

TEST_CASE("lens: circles are those of rays traced through a thin lens", "[lens]") {
    const Camera camera = perspective_camera();
    for (const double focal_mm : {8.0, 50.0, 300.0})
        for (const double focus : {0.9, 7.0, 120.0})
            for (const double unit : {1000.0, 25.4}) {
                if (focus * unit <= focal_mm)
                    continue;
                const CircleOfConfusion circle = circle_of_confusion(
                    {.f_stop = 1.8, .focus = focus, .focal_length_mm = focal_mm, .sensor_mm = 36, .mm_per_unit = unit},
                    camera);
                for (const double z : {0.5, 0.9, 3.0, 7.0, 44.0, 1e4}) {
                    if (z * unit <= focal_mm)
                        continue;
                    const double traced = on_sensor_mm(focal_mm, 1.8, focus * unit, z * unit) * 480 / 36;
                    INFO(focal_mm << " mm at " << focus << ", z = " << z);
                    CHECK(std::abs(at(circle, z) - traced) <=
                          1e-12 * (std::abs(traced) + static_cast<double>(circle.k)));
                }
                CHECK(std::abs(at(circle, focus)) <= rounding * static_cast<double>(circle.k));
                CHECK(at(circle, infinity) == static_cast<double>(circle.k));
            }
}

TEST_CASE("lens: what is not given comes from the projection", "[lens]") {
    const Camera camera = perspective_camera(480, 270, 0.5); // fx = 480 pixels: 36 mm on a sensor 36 mm wide
    const double focus = 7, aperture = 0.036 / 2;
    for (const Lens& lens : {Lens{.f_stop = 2, .focus = focus, .sensor_mm = 36},
                             Lens{.f_stop = 2, .focus = focus, .focal_length_mm = 36}}) {
        const CircleOfConfusion circle = circle_of_confusion(lens, camera);
        CHECK(same(static_cast<double>(circle.k), aperture * 480 / focus));
        CHECK(same(at(circle, 3), aperture * (480 / focus) * (1 - focus / 3)));
        CHECK(!circle.telecentric);
    }
    // Both given: they count, whatever the projection says.
    const Lens both{.f_stop = 2, .focus = focus, .focal_length_mm = 85, .sensor_mm = 24};
    const CircleOfConfusion wide = circle_of_confusion(both, perspective_camera(480, 270, 0.9)),
                            narrow = circle_of_confusion(both, camera);
    CHECK(wide.k == narrow.k);
    CHECK(same(static_cast<double>(wide.k), 42.5 * 85 / (7000 - 85) * 480 / 24));
}

TEST_CASE("lens: pixel scales are the projection's, off-centre, cropped and tilted too", "[lens]") {
    Camera camera = perspective_camera(400, 300, 0.4);
    CHECK(same(static_cast<double>(pixel_scale(camera).x), 500));
    CHECK(same(static_cast<double>(pixel_scale(camera).y), 500));
    camera.projection = perspective(Intrinsics{612, 487, 55, 290, 400, 300}, {0.1, infinity, DepthOrder::reversed},
                                    Convention::direct3d());
    CHECK(same(static_cast<double>(pixel_scale(camera).x), 612));
    CHECK(same(static_cast<double>(pixel_scale(camera).y), 487));
    camera.projection = with_oblique_near_plane(camera.projection, {0.1, 0.2, 1, -0.5});
    CHECK(same(static_cast<double>(pixel_scale(camera).x), 612, 1e-12));
    const PixelScale orthographic_scale = pixel_scale(orthographic_camera());
    CHECK(same(static_cast<double>(orthographic_scale.x), 40));
    CHECK(same(static_cast<double>(orthographic_scale.y), 30));
    // A tilted image plane: how far the slope x/z moves from pixel to pixel at the middle.
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
    matrix(0, 0) = 2;
    matrix(1, 1) = 3;
    matrix(2, 2) = -1.1;
    matrix(2, 3) = -0.5;
    matrix(3, 2) = -1;
    matrix(3, 0) = 0.2;
    camera.projection = from_matrix(matrix);
    // clip_x = 2X/(0.2X + Z) at depth Z: X/Z = clip_x/(2 − 0.2 clip_x), whose derivative at 0 is 1/2; 200 pixels a unit
    CHECK(same(static_cast<double>(pixel_scale(camera).x), 2 * 200.0, 1e-12));
}

TEST_CASE("lens: a focus at infinity keeps the circles finite", "[lens]") {
    const Camera camera = perspective_camera();
    for (const Lens& lens : {Lens{.f_stop = 2, .focus = infinity, .focal_length_mm = 50, .sensor_mm = 36},
                             Lens{.f_stop = 2, .focus = infinity, .sensor_mm = 36}}) {
        Lens far = lens;
        far.focus = 1e9;
        const CircleOfConfusion infinite = circle_of_confusion(lens, camera), almost = circle_of_confusion(far, camera);
        CHECK(infinite.k == 0);
        CHECK(same(static_cast<double>(infinite.g), static_cast<double>(almost.g), 1e-9));
        CHECK(at(infinite, infinity) == 0);
        CHECK(at(infinite, 10) < 0);
    }
    const CircleOfConfusion orthographic_coc =
        circle_of_confusion({.f_stop = 2, .focus = infinity, .focal_length_mm = 50}, orthographic_camera());
    CHECK(at(orthographic_coc, 1) == at(orthographic_coc, 90));
    CHECK(at(orthographic_coc, infinity) == at(orthographic_coc, 90));
}

TEST_CASE("lens: a pinhole has no circles", "[lens]") {
    for (const Camera& camera : {perspective_camera(), orthographic_camera()}) {
        const CircleOfConfusion circle =
            circle_of_confusion({.f_stop = infinity, .focus = 7, .focal_length_mm = 50}, camera);
        for (const double z : {0.1, 7.0, 1e6})
            CHECK(at(circle, z) == 0);
        CHECK(!depth_with_coc(circle, 0).has_value());
        CHECK(sharp_range(circle, 1).farthest == infinity);
    }
}

TEST_CASE("lens: the depth of a circle is the inverse of the circle of a depth", "[lens]") {
    const CircleOfConfusion circles[] = {
        {20, 140, 0, false}, {20, 140, -3, false}, {0, 140, 0, false}, {20, 3, 0, true}};
    for (const CircleOfConfusion& circle : circles)
        for (const double z : {0.01, 1.0, 7.0, 33.0, 1e7}) {
            const auto back = depth_with_coc(circle, coc_at(circle, z));
            REQUIRE(back.has_value());
            CHECK(same(static_cast<double>(*back), z, 1e-11));
        }
    CHECK(depth_with_coc(circles[0], 20) == infinity);
    CHECK(depth_with_coc(circles[2], 0) == infinity);
    CHECK(!depth_with_coc(circles[0], 20.5).has_value());
    CHECK(!depth_with_coc(circles[0], NAN).has_value());
    CHECK(!depth_with_coc({.k = 3, .g = 0, .telecentric = true}, -3).has_value());
    CHECK(std::isnan(at(circles[0], 0)));
    CHECK(std::isnan(at(circles[0], -1)));
    CHECK(at(circles[1], -1) == 20 - 140.0 / 2);
}

TEST_CASE("lens: the sharp range and the hyperfocal distance are those of the textbook", "[lens]") {
    const Camera camera = perspective_camera();
    const double focal = 0.05, f_stop = 4, pixels_per_unit = 480 / 0.036, acceptable = 0.5,
                 c = acceptable / pixels_per_unit;
    Lens lens{.f_stop = f_stop, .focus = 5, .focal_length_mm = 50, .sensor_mm = 36};
    const double hyperfocal = hyperfocal_distance(lens, camera, acceptable);
    CHECK(same(hyperfocal, focal * focal / (f_stop * c) + focal));
    for (const double focus : {-1.0, 0.0, infinity, std::nan("")}) { // which does not matter
        const Lens other{.f_stop = f_stop, .focus = focus, .focal_length_mm = 50, .sensor_mm = 36};
        CHECK(hyperfocal_distance(other, camera, acceptable) == hyperfocal);
    }
    const SharpRange range = sharp_range(circle_of_confusion(lens, camera), acceptable);
    const double square = focal * focal, rest = f_stop * c * (lens.focus - focal);
    CHECK(same(range.nearest, lens.focus * square / (square + rest), 1e-13));
    CHECK(same(range.farthest, lens.focus * square / (square - rest), 1e-13));
    // Focused at the hyperfocal distance, infinity is just acceptable, and so is half of it, to the focal length.
    lens.focus = hyperfocal;
    const CircleOfConfusion circle = circle_of_confusion(lens, camera);
    CHECK(same(static_cast<double>(circle.k), acceptable, 1e-13));
    CHECK(same(sharp_range(circle, acceptable).nearest, hyperfocal / 2, 1e-12));
    CHECK(sharp_range(circle, acceptable * (1 + 1e-12)).farthest == infinity);
    lens.focus = 2 * hyperfocal;
    CHECK(sharp_range(circle_of_confusion(lens, camera), acceptable).farthest == infinity);
    // The projection's own lens.
    const Lens derived{.f_stop = f_stop, .focus = 5, .sensor_mm = 36};
    const double h = hyperfocal_distance(derived, camera, acceptable);
    CHECK(same(static_cast<double>(circle_of_confusion({.f_stop = f_stop, .focus = h, .sensor_mm = 36}, camera).k),
               acceptable, 1e-13));
    const SharpRange orthographic_range = sharp_range({.k = 20, .g = 4, .telecentric = true}, 2);
    CHECK(orthographic_range.nearest == 4.5);
    CHECK(orthographic_range.farthest == 5.5);
    CHECK(std::isnan(sharp_range({.k = 20, .g = 0, .telecentric = true}, 2).nearest));
    CHECK(sharp_range({.k = 1, .g = 0, .telecentric = true}, 2).nearest == -infinity);
}

TEST_CASE("lens: a distance along a ray becomes one depth", "[lens]") {
    const Camera camera = perspective_camera(480, 270, 0.5);
    CHECK(same(depth_along_ray(camera, 240, 135, 7), 7));
    const double slope_x = 0.5 * (100.5 - 240) / 240, slope_y = 0.5 * 270 / 480 * (135 - 200.5) / 135;
    CHECK(same(depth_along_ray(camera, 100.5, 200.5, 7), 7 / std::sqrt(1 + slope_x * slope_x + slope_y * slope_y)));
    CHECK(depth_along_ray(camera, 0.5, 0.5, infinity) == infinity);
    CHECK(same(depth_along_ray(orthographic_camera(), 3.5, 7.5, -2), -2));
    // A camera centre moved back by 3: the distance is counted from there.
    Eigen::Matrix4d matrix = camera.projection.matrix.cast<double>(), shift = Eigen::Matrix4d::Identity();
    shift(2, 3) = -3;
    Camera moved = camera;
    moved.projection = from_matrix(matrix * shift);
    CHECK(same(depth_along_ray(moved, 240, 135, 7), 4, 1e-12));
    const CircleOfConfusion circle = circle_of_confusion({.f_stop = 2, .focus = 4, .sensor_mm = 36}, moved);
    CHECK(same(static_cast<double>(circle.lens_depth), -3, 1e-12));
    CHECK(std::abs(at(circle, 4)) < 1e-12);
    CHECK(same(static_cast<double>(circle.k), 0.018 * 480 / 7, 1e-12));
    // Surfaces before z = 0 are in front of the lens, too.
    CHECK(std::abs(at(circle_of_confusion({.f_stop = 2, .focus = -1, .sensor_mm = 36}, moved), -1)) < 1e-12);
    CHECK_THROWS_WITH(circle_of_confusion({.f_stop = 2, .focus = -3, .sensor_mm = 36}, moved),
                      "focus = -3 must lie in front of the lens, which is at depth -3");
}

TEST_CASE("lens: what is no lens is refused in one line", "[lens]") {
    const Camera camera = perspective_camera();
    const Lens good{.f_stop = 2, .focus = 7, .focal_length_mm = 50, .sensor_mm = 36};
    const auto message = [&](auto change, const Camera& of) -> std::string {
        Lens lens = good;
        change(lens);
        try {
            circle_of_confusion(lens, of);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "accepted";
    };
    CHECK(message([](Lens&) {}, camera) == "accepted");
    for (const double bad : {0.0, -1.0, std::nan("")}) {
        CHECK(message([&](Lens& l) { l.f_stop = bad; }, camera).find("f_stop = ") == 0);
        CHECK(message([&](Lens& l) { l.focal_length_mm = bad; }, camera).find("focal_length_mm = ") == 0);
        CHECK(message([&](Lens& l) { l.sensor_mm = bad; }, camera).find("sensor_mm = ") == 0);
        CHECK(message([&](Lens& l) { l.mm_per_unit = bad; }, camera).find("mm_per_unit = ") == 0);
        CHECK(message([&](Lens& l) { l.focus = bad; }, camera).find("focus = ") == 0);
        CHECK(message([&](Lens& l) { l.focus = bad; }, orthographic_camera()).find("focus = ") == 0);
    }
    CHECK(message([](Lens& l) { l.f_stop = 0; }, camera) == "f_stop = 0 must be a number above 0, or inf");
    CHECK(message([](Lens& l) { l.focal_length_mm = infinity; }, camera) ==
          "focal_length_mm = inf must be a finite number above 0");
    CHECK(message([](Lens& l) { l.focus = 0.05; }, camera) ==
          "focus = 0.05 must be farther away than the focal length, which is 0.05 scene units");
    CHECK(message([](Lens& l) { l.focal_length_mm.reset(), l.sensor_mm.reset(); }, camera) ==
          "the lens needs focal_length_mm or sensor_mm: the projection gives the other one");
    CHECK(message([](Lens& l) { l.focal_length_mm.reset(); }, orthographic_camera()) ==
          "orthographic rays have no focal length: the lens needs focal_length_mm for its aperture");
    CHECK_THROWS_WITH(hyperfocal_distance(good, orthographic_camera(), 1),
                      "orthographic rays have no hyperfocal distance: their circles grow without end");
    CHECK_THROWS_WITH(hyperfocal_distance(good, camera, 0), "acceptable_px = 0 must be a number above 0");
    CHECK_THROWS_WITH(sharp_range({20, 140, 0, false}, NAN), "acceptable_px = nan must be a number above 0");
    CHECK_THROWS_WITH(depth_along_ray(camera, 1, 1, 0), "distance = 0 must be above 0");
    CHECK_THROWS_AS(depth_along_ray(camera, 1, 1, NAN), std::invalid_argument);
}

TEST_CASE("lens: pixels that see over 100 times as much one way as the other are refused in one line", "[lens]") {
    Camera camera;
    camera.width = 64;
    camera.height = 48;
    camera.encoding = Encoding::view_z;
    const auto refused = [&] {
        try {
            pixel_scale(camera);
            return false;
        } catch (const std::invalid_argument& error) {
            return contains(error.what(), "times as much across as down");
        }
    };
    for (const double ratio : {1e-12, 1e-9, 1e-3, 0.02, 1.0, 50.0, 1e3, 1e9, 1e12}) {
        const bool beyond = ratio < 0.01 || ratio > 100;
        CAPTURE(ratio);
        camera.lens.reset();
        camera.projection = perspective(1, ratio * 64 / 48, {0.5, 100});
        CHECK(refused() == beyond);
        camera.projection = from_matrix(Eigen::Matrix4d(camera.projection.matrix.cast<double>()));
        CHECK(refused() == beyond);
        camera.projection = perspective(Intrinsics{50, 50 * ratio, 32, 24, 64, 48}, {0.5, 100});
        CHECK(refused() == beyond);
        camera.projection = orthographic({-ratio, ratio, -0.75, 0.75}, {0.5, 100});
        CHECK(refused() == beyond);
        camera.lens = LensModel{LensLaw::brown, 50, 50 * ratio, 32, 24, {0.01, 0, 0, 0}};
        CHECK(refused() == beyond);
    }
}

TEST_CASE("lens: a circle keeps every bit of the widest numbers", "[lens]") {
    std::mt19937_64 random(7);
    for (int i = 0; i < 1'000'000; ++i) {
        const auto exponent = static_cast<int>(random() % 2020) - 1000;
        const long double mantissa = 1 + static_cast<long double>(random() >> 1) * 0x1p-63L;
        const long double value = std::ldexp(i % 2 == 0 ? mantissa : -mantissa, exponent);
        const DoubleDouble kept = value;
        REQUIRE(static_cast<long double>(kept) == value);
        REQUIRE(std::abs(kept.low) <= 0x1p-53 * std::abs(kept.high));
    }
    for (const long double value : {0.0L, -0.0L, 1.0L, static_cast<long double>(infinity), -1.0L / 3})
        CHECK(static_cast<long double>(DoubleDouble(value)) == value);
    CHECK(std::isnan(static_cast<long double>(DoubleDouble(std::nan("")))));
}
