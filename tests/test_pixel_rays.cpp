// Rays of pixels through lenses, against formulas and a search of the test's own in long double, and their patches.
// The tolerance is pixel_rays_round_trip_px; of the patches it is patch_error, and patch_slope_error for the derivatives.

#include "catch.hpp"
#include "lenses.hpp"

#include "lens/patches.hpp"

#include <fathom/pixel_rays.hpp>

#include <ctime>

using namespace fathom;

namespace {

using Real = long double;
using Vector2 = Eigen::Matrix<Real, 2, 1>;
using Vector3 = Eigen::Matrix<Real, 3, 1>;

constexpr Real pi = 3.14159265358979323846264338327950288L;

// How far from the middle a lens images what lies at an angle, without what moves it sideways: in focal lengths.
Real radius_at(const LensModel& lens, Real angle) {
    const auto k = [&](std::size_t i) { return i < lens.k.size() ? static_cast<Real>(lens.k[i]) : 0; };
    switch (lens.law) {
    case LensLaw::brown: {
        const Real t = std::tan(angle), q = t * t;
        return t * (1 + k(0) * q + k(1) * q * q + k(4) * q * q * q) / (1 + k(5) * q + k(6) * q * q + k(7) * q * q * q);
    }
    case LensLaw::equisolid:
        return 2 * std::sin(angle / 2);
    case LensLaw::stereographic:
        return 2 * std::tan(angle / 2);
    case LensLaw::opencv_fisheye:
        return angle + k(0) * std::pow(angle, 3) + k(1) * std::pow(angle, 5) + k(2) * std::pow(angle, 7) +
               k(3) * std::pow(angle, 9);
    default:
        return angle;
    }
}

// Blender's: the other way round.
Real blender_angle(const LensModel& lens, Real r) {
    Real sum = 0;
    for (std::size_t i = 5; i-- > 0;)
        sum = sum * r - static_cast<Real>(lens.k[i]);
    return sum;
}

// The greatest radius before the law turns back: 0 where every radius has a ray.
Real largest_radius(const LensModel& lens) {
    if (lens.law == LensLaw::double_sphere)
        return lens.k[1] > 0.5 ? 1 / std::sqrt(2 * static_cast<Real>(lens.k[1]) - 1) : 0;
    if (lens.law == LensLaw::equirectangular)
        return 0;
    constexpr int steps = 1 << 17;
    Real last = 0;
    if (lens.law == LensLaw::blender_polynomial) {
        for (int i = 1; i <= steps; ++i) {
            const Real r = 200.0L * i / steps, angle = blender_angle(lens, r);
            if (angle <= last || angle > pi)
                return r;
            last = angle;
        }
        return 0;
    }
    const Real end = lens.law == LensLaw::brown ? pi / 2 * (1 - 1e-6L) : pi;
    for (int i = 1; i <= steps; ++i) {
        const Real r = radius_at(lens, end * i / steps);
        if (r < last)
            break;
        last = r;
    }
    return last;
}

// What a lens makes of a direction, X right, Y down, Z ahead: the makers' own formulas. In focal lengths.
Vector2 imaged(const LensModel& lens, Real largest, const Vector3& ray) {
    const Real across = std::hypot(ray.x(), ray.y()), angle = std::atan2(across, ray.z());
    const auto k = [&](std::size_t i) { return i < lens.k.size() ? static_cast<Real>(lens.k[i]) : 0; };
    const Vector2 side = across > 0 ? Vector2(ray.head<2>() / across) : Vector2(0, 0);
    switch (lens.law) {
    case LensLaw::brown: {
        const Real x = ray.x() / ray.z(), y = ray.y() / ray.z(), q = x * x + y * y;
        const Real g =
            (1 + k(0) * q + k(1) * q * q + k(4) * q * q * q) / (1 + k(5) * q + k(6) * q * q + k(7) * q * q * q);
        return {x * g + 2 * k(2) * x * y + k(3) * (q + 2 * x * x) + k(8) * q + k(9) * q * q,
                y * g + k(2) * (q + 2 * y * y) + 2 * k(3) * x * y + k(10) * q + k(11) * q * q};
    }
    case LensLaw::double_sphere: {
        const Real d1 = ray.norm(), xi = k(0), alpha = k(1),
                   d2 = std::sqrt(across * across + (xi * d1 + ray.z()) * (xi * d1 + ray.z()));
        return ray.head<2>() / (alpha * d2 + (1 - alpha) * (xi * d1 + ray.z()));
    }
    case LensLaw::equirectangular:
        return {std::atan2(ray.x(), ray.z()), std::atan2(ray.y(), std::hypot(ray.x(), ray.z()))};
    case LensLaw::blender_polynomial: { // the angle's radius, by halves
        Real low = 0, high = largest;
        for (int i = 0; i < 80; ++i)
            (blender_angle(lens, (low + high) / 2) < angle ? low : high) = (low + high) / 2;
        return side * low;
    }
    default:
        return side * radius_at(lens, angle);
    }
}

Vector3 in_lens_axes(const Camera& camera, const Eigen::Vector3d& ray) {
    const ViewAxes axes = camera.projection.convention.view_axes;
    return {ray.x(), axes == ViewAxes::opencv ? ray.y() : -ray.y(), axes == ViewAxes::opengl ? -ray.z() : ray.z()};
}

Real row_from_top(const Camera& camera, Real y) {
    return camera.rows == Rows::top_down ? y : camera.height - y;
}

} // namespace

TEST_CASE("PixelRays: every pixel has the ray of its lens, or none", "[lens]") {
    for (const auto& [name, camera] : lens_subjects()) {
        INFO(name);
        const LensModel& lens = *camera.lens;
        const PixelRays rays(camera);
        const Real largest = largest_radius(lens);
        constexpr Real beside_fold = 1e-3; // of the largest radius: where the test's steps do not tell
        double worst = 0, worst_back = 0, worst_length = 0;
        long with = 0, without = 0, wrong = 0;
        for (int y = 0; y < camera.height; y += 7)
            for (int x = 0; x < camera.width; x += 5) {
                const double px = x + 0.5, py = y + 0.5;
                const Vector2 uv((static_cast<Real>(px) - static_cast<Real>(lens.cx)) / static_cast<Real>(lens.fx),
                                 (row_from_top(camera, static_cast<Real>(py)) - static_cast<Real>(lens.cy)) /
                                     static_cast<Real>(lens.fy));
                const auto ray = rays.ray_of(px, py);
                const bool sideways = lens.k.size() >= 4 && lens.law == LensLaw::brown && lens.k[2] != 0;
                const Real unsure = sideways ? 0.01L : beside_fold;
                if (largest > 0 && std::abs(uv.norm() / largest - 1) > unsure)
                    wrong += ray.has_value() != (uv.norm() < largest);
                if (!ray) {
                    wrong += largest == 0;
                    ++without;
                    continue;
                }
                ++with;
                worst_length = std::max(worst_length, std::abs(ray->norm() - 1));
                Vector2 off = imaged(lens, largest, in_lens_axes(camera, *ray)) - uv;
                if (lens.law == LensLaw::equirectangular)
                    off.x() = std::remainder(off.x(), 2 * pi);
                worst = std::max(worst, static_cast<double>(std::hypot(off.x() * static_cast<Real>(lens.fx),
                                                                       off.y() * static_cast<Real>(lens.fy))));
                const auto back = rays.pixel_of(*ray);
                REQUIRE(back);
                worst_back = std::max(worst_back, std::hypot(back->x() - px, back->y() - py));
            }
        std::printf("rays, %-42s %6ld with, %6ld without; off %.1e px, and back %.1e px\n", name.c_str(), with, without,
                    worst, worst_back);
        CHECK(with > 1000);
        CHECK(wrong == 0);
        CHECK(worst <= pixel_rays_round_trip_px);
        CHECK(worst_back <= pixel_rays_round_trip_px);
        CHECK(worst_length <= 0x1p-50);
    }
}

namespace {

// The part of the way from the middle to a place in the image, at most `farthest`, along which the lens does not fold: small
// steps, each with Newton's from the one before. 1 where it all but folds, and goes on.
Real way_before_fold(const LensModel& lens, const Vector2& uv, Real farthest) {
    constexpr int steps = 200;
    constexpr Real h = 1e-6L, all_but_folded = 0.05L;
    Real least = 1;
    Vector2 at(0, 0);
    for (int i = 1; i <= steps; ++i) {
        const Real part = farthest * i / steps;
        for (int j = 0; j < 3; ++j) {
            const auto seen = [&](Real x, Real y) { return imaged(lens, 0, {x, y, 1}); };
            Eigen::Matrix<Real, 2, 2> slopes;
            slopes << (seen(at.x() + h, at.y()) - seen(at.x() - h, at.y())) / (2 * h),
                (seen(at.x(), at.y() + h) - seen(at.x(), at.y() - h)) / (2 * h);
            if (!(slopes.determinant() > 0))
                return farthest * (i - 1) / steps;
            least = std::min(least, slopes.determinant());
            at -= slopes.inverse() * (seen(at.x(), at.y()) - part * uv);
        }
    }
    return least < all_but_folded ? 1 : farthest;
}

} // namespace

TEST_CASE("PixelRays: pixels of brown have a ray up to where p1, p2 and s1 to s4 fold it", "[lens]") {
    std::vector<std::vector<double>> all{{0, 0, 0.05, 0.05},
                                         {-0.1, 0, 0.05, 0.05},
                                         {-0.2, 0, 0.3, 0.2},
                                         {-0.3, 0.05, 0.02, -0.03},
                                         {0.1, -0.05, 0, 0, 0.01, 0.05, 0.02, 0.001, 0.05, -0.02, 0.05, 0.01}};
    std::mt19937 random(40);
    for (int i = 0; i < 12; ++i) {
        std::vector<double> k;
        for (const double most : {0.3, 0.2, 0.1, 0.1, 0.05, 0.1, 0.1, 0.05, 0.05, 0.02, 0.05, 0.02})
            k.push_back(std::uniform_real_distribution<double>(-most, most)(random));
        if (i % 2 == 0)
            k.resize(5);
        all.push_back(k);
    }
    constexpr Real farthest = 1.05L, unsure = 0.02L;
    long all_with = 0, all_without = 0;
    for (const std::vector<double>& k : all) {
        CAPTURE(k);
        Camera camera{.width = 640, .height = 480};
        camera.projection = perspective(1, 1, {1, 2}, {.view_axes = ViewAxes::opencv});
        camera.lens = LensModel{LensLaw::brown, 300, 300, 320, 240, k};
        const PixelRays rays(camera);
        long wrong = 0, with = 0, without = 0;
        double off = 0;
        for (int y = 4; y < camera.height; y += 23)
            for (int x = 4; x < camera.width; x += 29) {
                const Vector2 uv((x + 0.5L - 320) / 300, (y + 0.5L - 240) / 300);
                const Real way = way_before_fold(*camera.lens, uv, farthest);
                const auto ray = rays.ray_of(x + 0.5, y + 0.5);
                (ray ? with : without) += 1;
                if (std::abs(way - 1) > unsure)
                    wrong += ray.has_value() != (way > 1);
                if (!ray)
                    continue;
                off =
                    std::max(off, static_cast<double>(300 * (imaged(*camera.lens, 0, ray->cast<Real>()) - uv).norm()));
                const auto back = rays.pixel_of(*ray);
                REQUIRE(back);
                off = std::max(off, (*back - Eigen::Vector2d(x + 0.5, y + 0.5)).norm());
            }
        CHECK(wrong == 0);
        CHECK(off <= pixel_rays_round_trip_px);
        all_with += with;
        all_without += without;
    }
    std::printf("rays, brown up to its folds: %ld with, %ld without\n", all_with, all_without);
    CHECK(all_without > 1000);
}

TEST_CASE("PixelRays: a lens without distortion is the pinhole, whatever its axes, rows and part", "[lens]") {
    for (const ViewAxes axes : {ViewAxes::opengl, ViewAxes::directx, ViewAxes::opencv})
        for (const Rows rows : {Rows::top_down, Rows::bottom_up}) {
            Camera pinhole{.projection =
                               perspective(Intrinsics{300, 310, 150, 90, 320, 200}, {1, 2}, {.view_axes = axes}),
                           .width = 320,
                           .height = 200,
                           .rows = rows};
            Camera straight = pinhole;
            straight.lens = LensModel{LensLaw::brown, 300, 310, 150, 90, {0, 0, 0, 0}};
            const Camera part = cropped(straight, 37, -20, 100, 90);
            for (const auto& [x, y] : {std::pair{0.5, 0.5}, {319.5, 17.25}, {150.0, 90.0}, {40.0, 60.0}}) {
                const Eigen::Vector3d ray = ray_of(pinhole, x, y).value();
                CHECK((ray_of(straight, x, y).value() - ray).norm() <= 0x1p-50);
                CHECK((ray_of(part, x - 37, y + 20).value() - ray).norm() <= 0x1p-50);
                for (const Camera& camera : {pinhole, straight})
                    CHECK((pixel_of(camera, 7 * ray).value() - Eigen::Vector2d(x, y)).norm() <= 1e-12);
                CHECK_FALSE(pixel_of(pinhole, -ray));
                CHECK_FALSE(pixel_of(straight, -ray));
            }
        }
}

TEST_CASE("PixelRays: the middle column of a panorama looks ahead, and its right half to the right", "[lens]") {
    Camera camera{.width = 360, .height = 180};
    const double fx = 360 / (2 * std::numbers::pi);
    camera.lens = LensModel{LensLaw::equirectangular, fx, fx, 180, 90};
    for (int y = 0; y < 180; y += 13)
        for (int x = 0; x < 360; x += 11) {
            const double longitude = 2 * std::numbers::pi * ((x + 0.5) / 360 - 0.5),
                         latitude = std::numbers::pi * (0.5 - (y + 0.5) / 180);
            const Eigen::Vector3d ray(std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                                      -std::cos(latitude) * std::cos(longitude));
            CHECK((ray_of(camera, x + 0.5, y + 0.5).value() - ray).norm() <= 0x1p-50);
        }
    camera.lens->cx = 0; // from ahead all the way round
    CHECK(pixel_of(camera, {-1, 0, 0}).value().x() == Approx(270));
}

TEST_CASE("PixelRays: a fold has its angle, its radius and the coefficient that makes it", "[lens]") {
    Camera camera{.width = 100, .height = 100};
    const auto fold_of = [&](LensModel lens) {
        camera.lens = lens;
        return PixelRays(camera).fold();
    };
    const auto brown = fold_of({LensLaw::brown, 100, 100, 50, 50, {-0.35, 0, 0, 0}}); // 1 + 3 k1 t² = 0
    REQUIRE(brown);
    const double tangent = std::sqrt(1 / (3 * 0.35));
    CHECK(std::tan(brown->angle) == Approx(tangent).epsilon(1e-12));
    CHECK(brown->radius == Approx(tangent * 2 / 3).epsilon(1e-12));
    CHECK(brown->coefficient == "k1");
    const auto fisheye = fold_of({LensLaw::opencv_fisheye, 100, 100, 50, 50, {0, -0.05, 0, 0}}); // 1 + 5 k2 θ⁴ = 0
    REQUIRE(fisheye);
    CHECK(fisheye->angle == Approx(std::pow(4.0, 0.25)).epsilon(1e-12));
    CHECK(fisheye->coefficient == "k2");
    const auto blender =
        fold_of({LensLaw::blender_polynomial, 10, 10, 50, 50, {0, -0.1, 0, 0.001, 0}}); // 0.1 - 0.003 r² = 0
    REQUIRE(blender);
    CHECK(blender->radius == Approx(std::sqrt(0.1 / 0.003)).epsilon(1e-12));
    CHECK(blender->coefficient == "k3");
    for (const LensModel& none : {LensModel{LensLaw::brown, 100, 100, 50, 50, {0.1, 0, 0, 0}},
                                  {LensLaw::opencv_fisheye, 100, 100, 50, 50, {0, 0, 0, 0}},
                                  {LensLaw::equisolid, 100, 100, 50, 50}})
        CHECK_FALSE(fold_of(none));
}

TEST_CASE("PixelRays: what is no lens is refused with its number", "[lens]") {
    const auto refused = [](const LensModel& lens) {
        Camera camera{.width = 10, .height = 10};
        camera.lens = lens;
        try {
            PixelRays{camera};
        } catch (const std::invalid_argument& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THAT(refused({LensLaw::brown, 10, 10, 5, 5, {0.1, 0, 0}}),
               ContainsSubstring("has 3 coefficients; it takes 4, 5"));
    CHECK_THAT(refused({LensLaw::opencv_fisheye, 10, 10, 5, 5, {0.1}}),
               ContainsSubstring("has 1 coefficients; it takes 4"));
    CHECK_THAT(refused({LensLaw::equidistant, 10, 10, 5, 5, {0.1}}),
               ContainsSubstring("it takes 0, and what ROS and Kalibr call so is opencv-fisheye"));
    CHECK_THAT(refused({LensLaw::brown, 10, 10, 5, 5, std::vector<double>(14)}),
               ContainsSubstring("no tilted sensor; write its rays into an image"));
    for (const double each : {nan, 1e300, -1e300})
        CHECK_THAT(refused({LensLaw::brown, 10, 10, 5, 5, {each, 0, 0, 0}}),
                   ContainsSubstring("must be finite, and at most 1e+30"));
    CHECK_THAT(refused({LensLaw::equidistant, 0, 10, 5, 5}), ContainsSubstring("fx = 0"));
    CHECK_THAT(refused({LensLaw::double_sphere, 10, 10, 5, 5, {0.1, 1}}), ContainsSubstring("alpha = 1"));
    CHECK_THAT(refused({LensLaw::blender_polynomial, 10, 10, 5, 5, {0.1, -1, 0, 0, 0}}), ContainsSubstring("k0 = 0.1"));
    CHECK_THAT(refused({LensLaw::blender_polynomial, 10, 10, 5, 5, {0, 1, 0, 0, 0}}), ContainsSubstring("k1 = 1"));
    Camera flat{.projection = orthographic({-1, 1, -1, 1}, {0, 1}), .width = 10, .height = 10};
    CHECK_THROWS_WITH(PixelRays{flat}, ContainsSubstring("orthographic"));
    CHECK_THROWS_WITH(pixel_of(Camera{.projection = perspective(1, 1, {1, 2}), .width = 1, .height = 1}, {0, 0, 0}),
                      ContainsSubstring("direction"));
}

TEST_CASE("Patches are within their bound of the rays, and so are their derivatives", "[lens]") {
    for (const auto& [name, camera] : lens_subjects())
        for (const bool along_axis : {false, true}) {
            INFO(name << (along_axis ? ", along the axis" : ", along the ray"));
            const lens::CameraLens lens(camera);
            const PixelRays rays(camera);
            const lens::Patches patches = lens::patches_of(lens, camera.width, camera.height, along_axis);
            std::mt19937 random(1);
            std::uniform_int_distribution<int> column(0, camera.width - 1), row(0, camera.height - 1);
            double worst = 0, worst_slope = 0;
            long wrong = 0;
            for (int i = 0; i < 20000; ++i) {
                const int x = column(random), y = row(random);
                const auto exact = rays.ray_of(x + 0.5, y + 0.5);
                const auto [u, across, down] = patches.at(x, y);
                wrong += exact.has_value() == std::isnan(u.x());
                if (!exact)
                    continue;
                const double unit = along_axis ? std::max(lens.ahead(*exact), lens::least_ahead()) : 1;
                worst = std::max(worst, (u - *exact).norm() / unit);
                // Central differences, but beside a fold, where they say nothing: with bend/slope below 1e-3 they are off by
                // less than its square.
                constexpr double step = 0x1p-7, straight = 1e-3;
                for (const auto& [dx, dy, slope] : {std::tuple{step, 0.0, across}, {0.0, step, down}}) {
                    const auto after = rays.ray_of(x + 0.5 + dx, y + 0.5 + dy),
                               before = rays.ray_of(x + 0.5 - dx, y + 0.5 - dy);
                    if (!after || !before)
                        continue;
                    const Eigen::Vector3d difference = *after - *before, bend = *after - 2 * *exact + *before;
                    if (bend.norm() < straight * difference.norm())
                        worst_slope = std::max(worst_slope, (2 * step * slope - difference).norm() / difference.norm());
                }
            }
            std::printf("patches, %-42s %-4s off %.3f * 2^-24, slopes %.1e, %5.2f bytes a pixel\n", name.c_str(),
                        along_axis ? "axis" : "ray", worst * 0x1p24, worst_slope,
                        80.0 * static_cast<double>(patches.nodes.size()) / camera.width / camera.height);
            CHECK(wrong == 0);
            CHECK(worst <= lens::patch_error);
            CHECK(worst_slope <= lens::patch_slope_error);
        }
}

TEST_CASE("PixelRays: each pixel of a map has its ray, and is found by it, whatever its neighbours have", "[lens]") {
    const std::tuple<std::string, std::function<bool(int, int)>> kinds[] = {
        {"all", [](int, int) { return true; }},
        {"a row", [](int, int y) { return y == 70; }},
        {"a column", [](int x, int) { return x == 200; }},
        {"every other pixel", [](int x, int y) { return (x + y) % 2 == 0; }},
        {"one of 25", [](int x, int y) { return x % 5 == 0 && y % 5 == 0; }},
        {"all but one of 7", [](int x, int y) { return (x * 3 + y * 5) % 7 != 0; }}};
    for (const std::size_t subject : {1, 4, 9, 11, 12})
        for (const auto& [kind, is_kept] : kinds) {
            const auto [name, camera] = lens_subjects().at(subject);
            CAPTURE(name, kind);
            const RayMap map = mapped_rays(camera, is_kept);
            Camera mapped = camera;
            mapped.lens = lens_of_rays(map);
            const PixelRays exact(camera), rays(mapped);
            const std::clock_t start = std::clock();
            long asked = 0, lost = 0;
            double off = 0, away = 0;
            for (int y = 0; y < map.height; ++y)
                for (int x = 0; x < map.width; ++x) {
                    const auto truth = exact.ray_of(x + 0.5, y + 0.5), ray = rays.ray_of(x + 0.5, y + 0.5);
                    lost += ray.has_value() != (truth && is_kept(x, y));
                    if (!ray)
                        continue;
                    ++asked;
                    off = std::max(off, (*ray - *truth).norm());
                    // Single pixels leave nothing to follow to a panorama's poles.
                    const auto back = rays.pixel_of(*ray);
                    lost += !back && !(kind == "one of 25" && camera.lens->law == LensLaw::equirectangular);
                    if (back)
                        away = std::max(away, (*back - Eigen::Vector2d(x + 0.5, y + 0.5)).norm());
                    if (const auto between = rays.ray_of(x + 0.8, y + 1.4); between && kind == "all") {
                        const auto seen = rays.pixel_of(*between);
                        lost += !seen;
                        if (seen)
                            away = std::max(away, (*seen - Eigen::Vector2d(x + 0.8, y + 1.4)).norm());
                    }
                }
            const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
            std::printf("a map of %-20s %-18s %6ld pixels, there and back %.1e px, in %.2f s\n", name.c_str(),
                        kind.c_str(), asked, away, seconds);
            CHECK(asked > 100);
            CHECK(lost == 0);
            CHECK(off <= 0x1p-23);
            CHECK(away <= pixel_rays_round_trip_px);
            CHECK(seconds < 10); // a search of the whole map takes minutes
        }
    Camera one{.width = 1, .height = 1};
    one.lens = lens_of_rays({1, 1, {0, 0, 1}});
    CHECK(ray_of(one, 0.5, 0.5) == Eigen::Vector3d(0, 0, -1));
    CHECK(pixel_of(one, {0, 0, -2}) == Eigen::Vector2d(0.5, 0.5));
}

TEST_CASE("PixelRays: a map of rays is the lens that it was made of, up to its floats", "[lens]") {
    const Camera fisheye = lens_subjects().at(4).camera;
    const PixelRays exact(fisheye);
    const RayMap map = mapped_rays(fisheye);
    Camera mapped = fisheye;
    mapped.lens = lens_of_rays(map);
    CHECK(lens_of_rays(map).map == mapped.lens->map); // so that a shot's frames share what is made of it
    RayMap other = map;
    other.rays.back() += 1e-3f;
    CHECK(lens_of_rays(other).map != mapped.lens->map);
    const PixelRays rays(mapped);
    const lens::CameraLens through(mapped), named(fisheye);
    double off = 0, slopes = 0, back = 0, between = 0;
    for (int y = 0; y < map.height; y += 7)
        for (int x = 0; x < map.width; x += 7) {
            const auto ray = rays.ray_of(x + 0.5, y + 0.5);
            const bool inside = exact.ray_of(x + 1.5, y + 1.5) && exact.ray_of(x - 0.5, y - 0.5);
            if (!ray || !inside || x == 0 || y == 0)
                continue;
            off = std::max(off, (*ray - *exact.ray_of(x + 0.5, y + 0.5)).norm());
            const auto mine = through.ray(x + 0.5, y + 0.5), its = named.ray(x + 0.5, y + 0.5);
            for (std::size_t i = 0; i < 3; ++i)
                slopes = std::max({slopes, std::abs((*mine)[i].x - (*its)[i].x), std::abs((*mine)[i].y - (*its)[i].y)});
            if (const auto beside = rays.ray_of(x + 0.8, y + 0.9))
                between = std::max(between, (*beside - *exact.ray_of(x + 0.8, y + 0.9)).norm());
            if (x % 35 == 0 && y % 35 == 0)
                back = std::max(back, (*rays.pixel_of(*ray) - Eigen::Vector2d(x + 0.5, y + 0.5)).norm());
        }
    const double pixel = 2 / fisheye.lens->fx;
    std::printf("a map of rays: off %.2g, slopes %.2g, between pixels %.2g, there and back %.2g px\n", off, slopes,
                between, back);
    CHECK(off <= 0x1p-23);
    CHECK(slopes <= 0x1p-23 + pixel * pixel * pixel * pixel); // differences of floats, and the fifth derivative
    CHECK(between <= pixel * pixel / 4);
    CHECK(back <= pixel_rays_round_trip_px);
    const std::optional<Eigen::Vector2d> behind = rays.pixel_of({0, 0, -1});
    CHECK_FALSE(behind);
    mapped.width = 2 * map.width;
    CHECK_THROWS_WITH(PixelRays(mapped), ContainsSubstring("map of rays"));
    CHECK_THROWS_WITH(lens_of_rays({4, 4, std::vector<float>(47)}), ContainsSubstring("47"));
    CHECK(
        (ray_of(cropped(Camera(fisheye), 30, 20, 60, 50), 5.5, 6.5).value() - exact.ray_of(35.5, 26.5).value()).norm() <
        1e-15);
    mapped.width = map.width;
    CHECK((ray_of(cropped(mapped, 130, 70, 60, 50), 5.5, 6.5).value() - exact.ray_of(135.5, 76.5).value()).norm() <
          0x1p-23);
}
