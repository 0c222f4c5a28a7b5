// The oracle's own truth: what the analytic scenes say must hold by projection and by plain geometry.

#include "catch.hpp"
#include "scene/scene.hpp"

using namespace fathom;
using Eigen::Vector3d;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double rounding = 1e-12; // of positions and pixels that went through a matrix and its inverse

Camera with(const Projection& projection, int width = 31, int height = 23) {
    return {.projection = projection, .width = width, .height = height};
}

std::vector<Camera> cameras() {
    const double fov = std::numbers::pi / 3;
    const Convention reversed_z{ClipZ::zero_to_one, ClipY::down, ViewAxes::opencv};
    const auto wide = perspective(fov, 1.3, {0.1, 500});
    return {with(wide),
            with(perspective(fov, 1.3, {0.1, infinity, DepthOrder::reversed}, reversed_z)),
            with(perspective(FrustumEdges{-0.02, 0.09, -0.06, 0.03}, {0.1, 500}, Convention::direct3d())),
            with(with_oblique_near_plane(wide, {0.2, 0.1, -1, -3})),
            with(orthographic({-5, 6, -4, 3}, {0.5, 500})),
            with(with_oblique_near_plane(orthographic({-5, 6, -4, 3}, {0.5, 500}), {0.2, 0.1, -1, -3}))};
}

/// The pixel, and the stored value in the window encoding, that a view-space point is seen at.
Vector3d project(const Camera& camera, const Vector3d& position) {
    const Projection& p = camera.projection;
    const auto clip = (p.matrix * position.cast<long double>().homogeneous()).eval();
    const Vector3d ndc = (clip.head<3>() / clip.w()).cast<double>();
    const double y = p.convention.clip_y == ClipY::up ? -ndc.y() : ndc.y();
    const double z = p.convention.clip_z == ClipZ::negative_one_to_one ? (ndc.z() + 1) / 2 : ndc.z();
    return {(ndc.x() + 1) / 2 * camera.width, (y + 1) / 2 * camera.height, z};
}

} // namespace

TEST_CASE("scene: every surface projects back to its pixel and its stored depth", "[scene]") {
    for (const Camera& camera : cameras()) {
        int seen = 0;
        for (const auto& name : scene::names()) {
            const auto image = scene::render(scene::named(name), camera);
            for (int y = 0; y < image.height; ++y)
                for (int x = 0; x < image.width; ++x) {
                    const auto i = static_cast<std::size_t>(y * image.width + x);
                    if (std::isinf(image.z[i])) {
                        REQUIRE(image.exact[i] == scene::clear_value(camera));
                        continue;
                    }
                    ++seen;
                    const Vector3d at = project(camera, image.position[i]);
                    INFO(name << " at " << x << ", " << y);
                    REQUIRE(std::abs(at.x() - x - 0.5) < rounding * 1e3);
                    REQUIRE(std::abs(at.y() - y - 0.5) < rounding * 1e3);
                    REQUIRE(std::abs(at.z() - image.exact[i]) < rounding);
                    REQUIRE(std::abs(image.normal[i].norm() - 1) < rounding);
                }
        }
        REQUIRE(seen > 1000);
    }
}

TEST_CASE("scene: the nearest surface behind the near plane is the one that is seen", "[scene]") {
    const scene::Scene nested{scene::Sphere{{0, 0, -5}, 2}, scene::Sphere{{0, 0, -5}, 1},
                              scene::Disk{{0, 0, -2}, {0, 0, 1}, 1}, scene::Box{{0, 0, -5}, {0.1, 0.1, 0.1}, 0.4}};
    const auto centre_depth = [&](double near) {
        const Camera camera = with(orthographic({-1, 1, -1, 1}, {near, 20}));
        return scene::cast(nested, camera, 15.5, 11.5)->z;
    };
    CHECK(centre_depth(0) == Approx(2));
    CHECK(centre_depth(2.5) == Approx(3));
    CHECK(centre_depth(3.5) == Approx(4));
    CHECK(centre_depth(4.5) == Approx(5 - 0.1 / std::cos(0.4)));
    CHECK(centre_depth(5.5) == Approx(6));
    CHECK(centre_depth(6.5) == Approx(7));
    const Camera behind = with(orthographic({-1, 1, -1, 1}, {7.5, 20}));
    CHECK_FALSE(scene::cast(nested, behind, 15.5, 11.5).has_value());
}

TEST_CASE("scene: a free ray is blocked within its length, from either side of a surface", "[scene]") {
    const scene::Scene scene{scene::Plane{{0, 0, -5}, {0, 0, 1}}, scene::Sphere{{0, 3, 0}, 1},
                             scene::Bowl{{0, -5, 0}, 2, {0, 1, 0}, 1}};
    const Vector3d ahead(0, 0, -1), up(0, 1, 0);
    CHECK(scene::blocked(scene, {0, 0, 0}, ahead, 5));
    CHECK_FALSE(scene::blocked(scene, {0, 0, 0}, ahead, 4.999));
    CHECK(scene::blocked(scene, {0, 0, -7}, -ahead, 2.1));
    CHECK_FALSE(scene::blocked(scene, {0, 0, -7}, ahead));
    CHECK_FALSE(scene::blocked(scene, {0, 0, -5}, -ahead)); // starts on the plane
    CHECK(scene::blocked(scene, {0, 0, -5}, -ahead, 1, -1e-9));
    CHECK(scene::blocked(scene, {0, 3, 0}, up, 1)); // from within the sphere
    CHECK_FALSE(scene::blocked(scene, {0, 3, 0}, up, 0.999));
    CHECK_FALSE(scene::blocked(scene, {0, -6.5, 0}, up, 4)); // out of the bowl
    CHECK(scene::blocked(scene, {0, -6.5, 0}, -up));
    CHECK(scene::blocked(scene, {0, -8, 0}, up, 1)); // into its outside
}
