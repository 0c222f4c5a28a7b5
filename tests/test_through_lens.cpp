// linearize and unproject through lenses, against long double: every law, encodings along the axis and along the ray.
// The tolerance is unproject_relative_error of the distance. Rays are those of PixelRays, which test_pixel_rays.cpp checks.

#include "catch.hpp"
#include "images.hpp"
#include "lenses.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>
#include <fathom/pixel_rays.hpp>

using namespace fathom;

namespace {

using Real = long double;
using Vector3 = Eigen::Matrix<Real, 3, 1>;

// The distance of a slanted wall and of a sphere around the camera, whichever is nearer; by pixels, as a renderer writes it.
std::vector<float> rendered(const std::vector<PixelRay>& rays, double forwards, bool along_axis) {
    const Eigen::Vector3d wall = Eigen::Vector3d(0.3, -0.2, forwards).normalized();
    std::vector<float> depth;
    for (const auto& ray : rays) {
        const double nearer = ray && wall.dot(*ray) > 0.2 ? std::min(2.5 / wall.dot(*ray), 9.0) : 9.0;
        depth.push_back(static_cast<float>(nearer * (ray && along_axis ? forwards * ray->z() : 1)));
    }
    return depth;
}

struct Worst {
    double off = 0; // in 2⁻²⁴ of the distance
    long judged = 0, wrong = 0;
};

} // namespace

TEST_CASE("unproject: positions through a lens are within their bound, in view and in world space",
          "[lens][unproject]") {
    const Device device = test_device();
    const Eigen::Matrix4d view = turned_view();
    for (const auto& [name, plain] : lens_subjects()) {
        const std::vector<PixelRay> rays = all_rays(plain);
        const double forwards = forwards_of(plain);
        for (const bool along_axis : {false, true})
            for (const Space space : {Space::view, Space::world}) {
                Camera camera = plain;
                camera.encoding = along_axis ? Encoding::view_z : Encoding::ray_distance;
                camera.view = view;
                INFO(name << (along_axis ? ", view-z" : ", ray-distance") << (space == Space::world ? ", world" : ""));
                const std::vector<float> depth = rendered(rays, forwards, along_axis);
                const Image image = Image::from_host(device, Element::f32, depth.data(), {camera.width, camera.height});
                std::vector<float> positions(depth.size() * 3), z(depth.size()), length(z);
                const StoredDepth stored{image, camera};
                unproject(stored, {.space = space}).download(positions.data());
                linearize(stored).image.download(z.data());
                linearize(stored, {.as = Along::ray}).image.download(length.data());
                const Eigen::Matrix<Real, 4, 4> to_world = view.inverse().cast<Real>();
                const Vector3 centre =
                    space == Space::world ? Vector3(to_world.topRightCorner<3, 1>()) : Vector3::Zero();
                Worst worst;
                for (std::size_t i = 0; i < z.size(); ++i) {
                    const auto& ray = rays[i];
                    const float* at = &positions[3 * i];
                    const double ahead = ray ? forwards * ray->z() : 0,
                                 steep = ahead / std::cos(89 * std::numbers::pi / 180);
                    if (!ray || (along_axis && !(steep > 1))) {
                        if (!ray || steep < 1 - 1e-6)
                            worst.wrong += !std::isnan(at[0]) || !std::isnan(at[2]) || !std::isnan(length[i]);
                        continue;
                    }
                    const Real distance = static_cast<Real>(depth[i]) / static_cast<Real>(along_axis ? ahead : 1);
                    Vector3 exact = distance * ray->cast<Real>();
                    if (space == Space::world)
                        exact = to_world.topLeftCorner<3, 3>() * exact + centre;
                    const Vector3 got(at[0], at[1], at[2]);
                    const Real away = distance + centre.norm();
                    const auto relative = [&](Real off, Real of) {
                        return static_cast<double>(std::abs(off) / of) * 0x1p24;
                    };
                    worst.off =
                        std::max({worst.off, relative((got - exact).norm(), away),
                                  relative(static_cast<Real>(z[i]) - distance * static_cast<Real>(ahead), distance),
                                  relative(static_cast<Real>(length[i]) - distance, distance)});
                    worst.wrong += !(worst.off >= 0) || std::isnan(at[0]) || std::isnan(z[i]) || std::isnan(length[i]);
                    ++worst.judged;
                }
                std::printf("through %-42s %-4s %-5s off %.2f * 2^-24 of the distance\n", name.c_str(),
                            along_axis ? "axis" : "ray", space == Space::world ? "world" : "view", worst.off);
                CHECK(worst.judged > 10000);
                CHECK(worst.wrong == 0);
                CHECK(worst.off <= unproject_relative_error * 0x1p24);
            }
    }
}

TEST_CASE("unproject: whatever depth through a lens counts along, positions are the same", "[lens][unproject]") {
    Eigen::Matrix4d view = turned_view();
    view.topRightCorner<3, 1>().setZero();
    struct Meaning {
        const char* name;
        Encoding encoding;
        Along along;
    };
    for (const Arithmetic arithmetic : {Arithmetic::fp64, Arithmetic::two_float}) {
        const Device device = test_device({.arithmetic = arithmetic});
        for (const std::size_t which : {1u, 7u, 9u, 11u, 13u})
            for (const auto& [meaning, encoding, along] :
                 {Meaning{"the axis", Encoding::view_z, Along::axis},
                  {"the ray", Encoding::ray_distance, Along::axis},
                  {"a cube", Encoding::view_z, Along::cube},
                  {"a cube, inverse", Encoding::inverse, Along::cube},
                  {"the axis, in a depth buffer", Encoding::window, Along::axis}}) {
                auto [name, camera] = lens_subjects().at(which);
                if (encoding == Encoding::window && camera.lens->law != LensLaw::brown)
                    continue;
                camera.encoding = encoding;
                camera.along = along;
                camera.view = view;
                camera.projection = perspective(1, 1, {0.25, 40}, camera.projection.convention);
                const double forwards = forwards_of(camera);
                const std::vector<PixelRay> rays = all_rays(camera);
                std::vector<float> values;
                std::vector<Real> distances; // of the rounded values; 0 where there is none
                std::mt19937 random(3);
                for (const auto& ray : rays) {
                    const double distance = 1 + static_cast<double>(random() % 10000) / 1000,
                                 ahead = ray ? forwards * ray->z() : 0;
                    const double part = along == Along::cube                 ? (ray ? ray->cwiseAbs().maxCoeff() : 1)
                                        : encoding == Encoding::ray_distance ? 1
                                                                             : ahead;
                    const double z = distance * part;
                    const bool is_window = encoding == Encoding::window, is_inverse = encoding == Encoding::inverse;
                    const double a = 40.0 / (40.0 - 0.25); // v = a (1 - near/z)
                    values.push_back(static_cast<float>(is_window ? a * (1 - 0.25 / z) : is_inverse ? 1 / z : z));
                    const auto v = static_cast<Real>(values.back());
                    const Real exact = is_window ? 0.25L / (1 - v / static_cast<Real>(a)) : is_inverse ? 1 / v : v;
                    distances.push_back(ray && part > 0.02 ? exact / static_cast<Real>(part) : 0);
                }
                const Image image =
                    Image::from_host(device, Element::f32, values.data(), {camera.width, camera.height});
                std::vector<float> positions(values.size() * 3);
                unproject({image, camera}, {.space = Space::world}).download(positions.data());
                const Eigen::Matrix3d turn = view.inverse().topLeftCorner<3, 3>();
                double worst = 0;
                for (std::size_t i = 0; i < rays.size(); ++i)
                    if (distances[i] > 0) {
                        const Vector3 exact = turn.cast<Real>() * rays[i]->cast<Real>() * distances[i];
                        const Vector3 got(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
                        worst = std::max(worst, static_cast<double>((got - exact).norm() / distances[i]) * 0x1p24);
                    }
                std::printf("depth along %-28s through %-28s %s: off %.2f * 2^-24\n", meaning, name.c_str(),
                            arithmetic == Arithmetic::fp64 ? "double" : "two floats", worst);
                INFO(meaning << ", " << name);
                CHECK(worst <= unproject_relative_error * 0x1p24);
            }
    }
}

TEST_CASE("linearize: through a lens the background and unmeasured pixels stay what they are", "[lens][linearize]") {
    Camera camera = lens_subjects().at(11).camera;
    camera.width = 64;
    camera.height = 32;
    camera.missing = 0;
    std::vector<float> values(64 * 32, 3.0f), z(values.size()), p(4 * values.size());
    values[70] = INFINITY;
    values[71] = 0;
    values[72] = NAN;
    const Device device = test_device();
    const Image image = Image::from_host(device, Element::f32, values.data(), {64, 32});
    for (const Along as : {Along::axis, Along::ray}) {
        linearize({image, camera}, {.as = as}).image.download(z.data());
        CHECK(z[70] == INFINITY);
        CHECK(std::isnan(z[71]));
        CHECK(std::isnan(z[72]));
        CHECK(std::isfinite(z[73]));
    }
    unproject({image, camera}, {.channels = 4}).download(p.data());
    for (const std::size_t i : {70u, 71u, 72u}) {
        CHECK(std::isnan(p[4 * i]));
        CHECK(p[4 * i + 3] == 0);
    }
    CHECK(p[4 * 73 + 3] == 1);
}

TEST_CASE("Whatever takes straight rays only refuses a lens, and names it", "[lens]") {
    const Camera camera = lens_subjects().at(1).camera;
    std::vector<float> values(static_cast<std::size_t>(camera.width * camera.height), 2.0f);
    const Device device = test_device();
    const Image image = Image::from_host(device, Element::f32, values.data(), {camera.width, camera.height});
    const Image color(device, Element::f32, {camera.width, camera.height, 3});
    const StoredDepth stored{image, camera};
    const auto refuses = [](const auto& act) { CHECK_THROWS_WITH(act(), ContainsSubstring("lens")); };
    refuses([&] { ssao(stored, 1, {.border = Border::clamp}); });
    refuses([&] { dof_masks(stored, CircleOfConfusion{1, 1}, {.max_near_coc = true}); });
    refuses([&] { dof_masks(stored, CircleOfConfusion{1, 1}, {.near_alpha = true}); });
    refuses([&] { dof_masks(stored, CircleOfConfusion{1, 1}, {.disocclusion = true}); });
    refuses([&] { dof_masks(stored, CircleOfConfusion{1, 1}, {.mixed_pixels = true}); });
    refuses([&] { unproject(stored, {.no_mixed_pixels = true}); });
    refuses([&] { upsample_along_edges(stored, color); });
    const Image other(device, Element::f32, {camera.width / 2, camera.height / 2, 3});
    CHECK_THROWS_WITH(upsample_along_edges(stored, other), ContainsSubstring("color is") && ContainsSubstring("lens") &&
                                                               ContainsSubstring("give both of one size") &&
                                                               !ContainsSubstring("upsample"));
    CHECK_THROWS_WITH(fog(stored, other, {.density = 0.1}),
                      ContainsSubstring("color is") && !ContainsSubstring("upsample"));
    refuses([&] { depth_form(camera); });
    refuses([&] { camera_rays(camera); });
    Camera fisheye = lens_subjects().at(4).camera;
    fisheye.encoding = Encoding::window;
    const std::vector<float> more(static_cast<std::size_t>(fisheye.width * fisheye.height), 2.0f);
    refuses([&] {
        linearize({Image::from_host(device, Element::f32, more.data(), {fisheye.width, fisheye.height}), fisheye});
    });
    Camera straight = camera;
    straight.lens.reset();
    straight.encoding = Encoding::view_z;
    straight.along = Along::cube;
    refuses([&] { linearize({image, straight}); });
}
