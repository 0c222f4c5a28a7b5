// normals, fog and dof_masks through lenses of every law, against planes and formulas in long double. Rays are those of
// PixelRays, which test_pixel_rays.cpp checks.

#include "catch.hpp"
#include "images.hpp"
#include "lenses.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>
#include <fathom/pixel_rays.hpp>

using namespace fathom;

namespace {

using Real = long double;

// Of planes: mean error of normals away from the plane's end, in degrees.
constexpr double plane_error_deg = 0.003;

struct Angles {
    std::vector<double> degrees;

    void add(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        degrees.push_back(std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi);
    }
    double mean() const {
        return std::accumulate(degrees.begin(), degrees.end(), 0.0) / static_cast<double>(degrees.size());
    }
    double share(double part) {
        const auto at = degrees.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(degrees.size() - 1));
        std::ranges::nth_element(degrees, at);
        return *at;
    }
};

Eigen::Vector3d vector_at(const std::vector<float>& all, std::size_t i) {
    return Eigen::Vector3f(all[3 * i], all[3 * i + 1], all[3 * i + 2]).cast<double>();
}

} // namespace

TEST_CASE("lens operations: normals of planes through every lens are exact but for the depth's rounding", "[lens]") {
    const Device device = test_device();
    for (const auto& [name, plain] : lens_subjects()) {
        const std::vector<PixelRay> rays = all_rays(plain);
        const PixelScale scale = pixel_scale(plain);
        for (const bool along_axis : {false, true})
            for (const NormalMethod method : {NormalMethod::neighbours, NormalMethod::least_squares}) {
                Camera camera = plain;
                camera.encoding = along_axis ? Encoding::view_z : Encoding::ray_distance;
                camera.view = turned_view();
                Angles off;
                long wrong = 0;
                for (const Eigen::Vector3d& wall : walls_around(camera)) {
                    const std::vector<float> depth = depth_of_wall(camera, rays, wall, 0.05);
                    const bool world = !along_axis;
                    const std::vector<float> found =
                        images::floats(normals(depth_of(device, camera, depth),
                                               {.method = method, .space = world ? Space::world : Space::view}));
                    const Eigen::Matrix3d turn = camera.view->topLeftCorner<3, 3>().transpose();
                    const Eigen::Vector3d truth = world ? Eigen::Vector3d(-(turn * wall)) : Eigen::Vector3d(-wall);
                    const auto width = static_cast<std::size_t>(camera.width);
                    for (std::size_t i = 0; i < depth.size(); ++i) {
                        const Eigen::Vector3d normal = vector_at(found, i);
                        const bool measured = depth[i] == depth[i];
                        wrong += measured == normal.isZero(0);
                        // A pixel without neighbours is taken to face the camera.
                        const bool inside = measured && i >= 2 * width && i + 2 * width < depth.size() &&
                                            i % width >= 2 && i % width + 2 < width;
                        const auto all_around = [&] {
                            for (const std::size_t by : {std::size_t{1}, std::size_t{2}, width, 2 * width})
                                if (std::isnan(depth[i - by]) && std::isnan(depth[i + by]))
                                    return false;
                            return true;
                        };
                        if (inside && all_around() &&
                            is_regular(camera, scale, rays, static_cast<int>(i % width), static_cast<int>(i / width)))
                            off.add(normal, truth);
                    }
                }
                std::printf("normals through %-42s %-4s %-14s mean %.5f, 99 %% %.5f, most %.4f degrees\n", name.c_str(),
                            along_axis ? "axis" : "ray",
                            method == NormalMethod::neighbours ? "neighbours" : "least squares", off.mean(),
                            off.share(0.99), off.share(1));
                INFO(name << (along_axis ? ", view-z" : ", ray-distance"));
                CHECK(off.degrees.size() > 10000);
                CHECK(wrong == 0);
                CHECK(off.mean() <= plane_error_deg);
            }
    }
}

TEST_CASE("lens operations: fog through every lens is within fog_error of the closed form", "[lens]") {
    const Device device = test_device();
    for (const auto& [name, plain] : lens_subjects()) {
        const std::vector<PixelRay> rays = all_rays(plain);
        for (const bool along_axis : {false, true})
            for (const bool height : {false, true}) {
                Camera camera = plain;
                camera.encoding = along_axis ? Encoding::view_z : Encoding::ray_distance;
                camera.view = turned_view();
                const FogOptions fog_options{.density = 0.11,
                                             .start = along_axis ? 0.75 : 0.0,
                                             .fog_color = {0.5, 0.6, 0.7},
                                             .height_falloff = height ? 0.35 : 0.0,
                                             .reference_height = 1.5,
                                             .whole_pixels = true};
                std::mt19937 random(11);
                std::vector<float> depth, color;
                for (const PixelRay& ray : rays) {
                    const auto part = ray ? part_stored(camera, *ray) : std::nullopt;
                    const double distance = 0.5 + static_cast<double>(random() % 10000) / 700;
                    depth.push_back(!part                ? no_depth
                                    : random() % 50 == 0 ? std::numeric_limits<float>::infinity()
                                                         : static_cast<float>(distance * *part));
                    for (int i = 0; i < 3; ++i)
                        color.push_back(static_cast<float>(random() % 1024) / 1024);
                }
                const Image picture =
                    Image::from_host(device, Element::f32, color.data(), {camera.width, camera.height, 3});
                const std::vector<float> found =
                    images::floats(fog(depth_of(device, camera, depth), picture, fog_options));
                const Eigen::Matrix4d world = camera.view->inverse();
                const Real h0 = static_cast<Real>(world(1, 3)), falloff = fog_options.height_falloff;
                double worst = 0;
                long wrong = 0;
                for (std::size_t i = 0; i < depth.size(); ++i) {
                    if (std::isnan(depth[i])) {
                        for (std::size_t c = 0; c < 3; ++c)
                            wrong += found[3 * i + c] != color[3 * i + c];
                        continue;
                    }
                    const Real part = *part_stored(camera, *rays[i]), begin = fog_options.start,
                               end = std::max(static_cast<Real>(depth[i]) / part, begin);
                    const Real rise = (world.topLeftCorner<3, 3>() * *rays[i]).y(), rate = falloff * rise;
                    const Real at_start = std::exp(-falloff * (h0 - fog_options.reference_height + rise * begin));
                    const Real length = height ? -std::expm1(-rate * (end - begin)) / rate : end - begin;
                    const Real opacity = -std::expm1(-fog_options.density * at_start * length);
                    for (std::size_t c = 0; c < 3; ++c) {
                        const Real before = color[3 * i + c], its = fog_options.fog_color[c],
                                   exact = before + opacity * (its - before);
                        worst =
                            std::max(worst, static_cast<double>(std::abs(static_cast<Real>(found[3 * i + c]) - exact) /
                                                                std::max(before, its)));
                    }
                }
                std::printf("fog through %-42s %-4s %-7s off %.2f * 2^-24 of the larger colour\n", name.c_str(),
                            along_axis ? "axis" : "ray", height ? "height" : "uniform", worst * 0x1p24);
                INFO(name << (along_axis ? ", view-z" : ", ray-distance") << (height ? ", height" : ", uniform"));
                CHECK(wrong == 0);
                CHECK(worst <= fog_error);
            }
    }
}

TEST_CASE("lens operations: circles of confusion through every lens are within coc_ulp", "[lens]") {
    const Device device = test_device();
    for (const auto& [name, plain] : lens_subjects()) {
        const std::vector<PixelRay> rays = all_rays(plain);
        const bool plane = plain.lens->law == LensLaw::brown;
        for (const bool along_axis : {false, true}) {
            Camera camera = plain;
            camera.encoding = along_axis ? Encoding::view_z : Encoding::ray_distance;
            // A lens of 20 mm at f/2 that is focused at 3 m.
            const CircleOfConfusion circle =
                circle_of_confusion({.f_stop = 2, .focus = 3, .focal_length_mm = 20}, camera);
            const Real scale = pixel_scale(camera).x, k = 0.01L * scale / 3, g = 0.01L * scale;
            CHECK(static_cast<double>(circle.k) == Approx(static_cast<double>(k)).epsilon(1e-12));
            CHECK(static_cast<double>(circle.g) == Approx(static_cast<double>(g)).epsilon(1e-12));
            std::mt19937 random(13);
            std::vector<float> depth;
            for (const PixelRay& ray : rays) {
                const auto part = ray ? part_stored(camera, *ray) : std::nullopt;
                const double distance = 0.3 + static_cast<double>(random() % 10000) / 700;
                depth.push_back(part ? static_cast<float>(distance * *part) : 1.0f);
            }
            const DofMasks masks = dof_masks(depth_of(device, camera, depth), circle,
                                             {.near_weight = true, .focus_weight = true, .far_weight = true});
            const std::vector<float> found = images::floats(masks.coc), near = images::floats(masks.near_weight),
                                     focus = images::floats(masks.focus_weight), far = images::floats(masks.far_weight);
            double worst = 0;
            long wrong = 0;
            for (std::size_t i = 0; i < depth.size(); ++i) {
                const auto part = rays[i] ? part_stored(camera, *rays[i]) : std::nullopt;
                const double ahead = rays[i] ? forwards_of(camera) * rays[i]->z() : 0;
                const bool at_89_degrees =
                    along_axis && rays[i] && std::abs(ahead / std::cos(89 * std::numbers::pi / 180) - 1) < 1e-5;
                if (at_89_degrees)
                    continue;
                if (!part || (plane && !(ahead > 0))) {
                    wrong += found[i] == found[i] || near[i] + focus[i] + far[i] != 0;
                    continue;
                }
                const Real distance = static_cast<Real>(depth[i]) / *part,
                           counted = plane ? distance * ahead : distance,
                           exact = static_cast<Real>(circle.k) - static_cast<Real>(circle.g) / counted;
                const float larger = std::max(static_cast<float>(std::abs(exact)), static_cast<float>(k));
                const auto ulp = static_cast<Real>(std::ldexp(1.0, std::ilogb(larger) - 23));
                worst = std::max(worst, static_cast<double>(std::abs(static_cast<Real>(found[i]) - exact) / ulp));
                wrong += found[i] != found[i] || near[i] + focus[i] + far[i] != 1;
            }
            std::printf("circles through %-42s %-4s off %.2f ulp\n", name.c_str(), along_axis ? "axis" : "ray", worst);
            INFO(name << (along_axis ? ", view-z" : ", ray-distance"));
            CHECK(wrong == 0);
            CHECK(worst <= coc_ulp);
        }
    }
}

TEST_CASE("lens operations: the focus of a lens is a plane for brown and a sphere otherwise", "[lens]") {
    for (const std::size_t which : {1u, 4u}) {
        const auto [name, camera] = lens_subjects().at(which);
        const double x = 10.5, y = 20.5, ahead = ray_of(camera, x, y)->z();
        const bool plane = camera.lens->law == LensLaw::brown;
        INFO(name);
        CHECK(depth_along_ray(camera, x, y, 4) == Approx(plane ? 4 * ahead : 4).epsilon(1e-12));
        const std::vector<float> depth(static_cast<std::size_t>(camera.width * camera.height), 4.0f);
        const StoredDepth stored = depth_of(test_device(), camera, depth);
        CHECK(depth_at(stored, 10, 20) == Approx(plane ? 4 * ahead : 4).epsilon(1e-6));
        LensArguments lens;
        lens.f_stop = 2;
        lens.focus_at = LensArguments::Pixel{10, 20};
        lens.focal_length_mm = 20;
        const DofMasks masks = dof_masks(stored, circle_for(lens, stored));
        CHECK(std::abs(images::floats(masks.coc)[static_cast<std::size_t>(20 * camera.width + 10)]) < 1e-5f);
        CHECK((widest_coc(stored, circle_for(lens, stored)) > 1e-3f) == plane);
    }
}
