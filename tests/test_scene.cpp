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

TEST_CASE("scene: a plane lies where its equation says, whatever the projection", "[scene]") {
    const scene::Plane plane{{0, 0, -5}, {0.5, 0.3, 1}};
    for (const Camera& camera : cameras()) {
        const double ahead = camera.projection.convention.view_axes == ViewAxes::opengl ? -1 : 1;
        const double up = camera.projection.convention.view_axes == ViewAxes::opencv ? -1 : 1;
        const auto image = scene::render({plane}, camera);
        double worst = 0;
        for (std::size_t i = 0; i < image.z.size(); ++i)
            if (std::isfinite(image.z[i])) {
                const Vector3d& p = image.position[i];
                const Vector3d in_opengl(p.x(), up * p.y(), -ahead * p.z());
                worst = std::max(worst, std::abs(plane.normal.dot(in_opengl - plane.point)) / p.norm());
                REQUIRE(image.z[i] == ahead * p.z());
            }
        REQUIRE(worst < rounding);
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

TEST_CASE("scene: hills are met where the ray's height is theirs", "[scene]") {
    const auto hills = std::get<scene::HeightField>(scene::terrain().front());
    const auto image = scene::render({hills}, with(perspective(std::numbers::pi / 3, 1.3, {0.1, infinity}), 64, 48));
    for (const Vector3d& p : image.position) {
        double y = hills.base;
        for (const auto& wave : hills.waves)
            y += wave.amplitude * std::sin(wave.kx * p.x() + wave.kz * p.z() + wave.phase);
        REQUIRE((std::isnan(p.y()) || std::abs(p.y() - y) < rounding * p.norm()));
    }
}

TEST_CASE("scene: a bowl is the part of a sphere below its rim", "[scene]") {
    // Open towards the camera, its lowest point at z = 7, its rim 1.5 above.
    const scene::Bowl bowl{{0, 0, -5}, 2, {0, 0, 1}, 1.5};
    const double rim = std::sqrt(2 * 2 - 0.5 * 0.5);
    const auto seen = [&](double x) {
        return scene::cast({bowl}, with(orthographic({-4, 4, -4, 4}, {0, 20})), x, 11.5);
    };
    const auto pixel = [](double x) { return (x / 8 + 0.5) * 31; };
    REQUIRE(seen(pixel(0)));
    CHECK(seen(pixel(0))->z == Approx(7));
    CHECK((seen(pixel(0))->normal - Vector3d(0, 0, 1)).norm() < rounding);
    REQUIRE(seen(pixel(rim - 1e-6)));
    CHECK(seen(pixel(rim - 1e-6))->z == Approx(5.5));
    CHECK_FALSE(seen(pixel(rim + 1e-6)));
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

TEST_CASE("scene: a caster's rays lead to what it sees", "[scene]") {
    for (const Camera& camera : cameras()) {
        const scene::Caster caster(scene::room(), camera);
        for (const auto& [x, y] : {std::pair{3.25, 7.5}, {15.5, 11.5}, {30.9, 0.1}}) {
            const scene::Ray ray = caster.ray(x, y);
            const auto seen = caster.at(x, y);
            const auto cast = scene::cast(scene::room(), camera, x, y);
            REQUIRE(seen.has_value() == cast.has_value());
            if (seen) {
                CHECK(seen->position == cast->position);
                CHECK((seen->position - ray.origin).cross(ray.direction.normalized()).norm() < rounding * 10);
                const double t = (seen->position - ray.origin).dot(ray.direction) / ray.direction.squaredNorm();
                CHECK((ray.first <= t && t <= ray.last));
            }
        }
    }
}

TEST_CASE("scene: encodings hold their definitions", "[scene]") {
    Camera camera = with(perspective(std::numbers::pi / 3, 1.3, {1, 100}));
    camera.near_plane = 1;
    camera.far_plane = 100;
    camera.median = 10;
    camera.log_c = 0.5;
    const auto stored = [&](Encoding encoding) {
        camera.encoding = encoding;
        return *scene::cast(scene::slant(), camera, 3.5, 4.5);
    };
    const double z = stored(Encoding::view_z).z;
    CHECK(stored(Encoding::view_z).stored == z);
    CHECK(stored(Encoding::ray_distance).stored == Approx(stored(Encoding::view_z).position.norm()).epsilon(1e-15));
    CHECK(stored(Encoding::window).stored == Approx(100 * (z - 1) / (99 * z)).epsilon(1e-14));
    CHECK(stored(Encoding::linear).stored == Approx((z - 1) / 99).epsilon(1e-15));
    CHECK(stored(Encoding::logarithmic).stored == Approx(std::log(z / 2 + 1) / std::log(51)).epsilon(1e-14));
    CHECK(stored(Encoding::exponential).stored == Approx(std::log(z) / std::log(100)).epsilon(1e-14));
    CHECK(stored(Encoding::median).stored == Approx(z / (z + 10)).epsilon(1e-14));
    CHECK(stored(Encoding::inverse).stored == Approx(1 / z).epsilon(1e-15));
}

TEST_CASE("scene: rows, axes and mirrors change the image as they should", "[scene]") {
    const auto projection = perspective(std::numbers::pi / 3, 1.3, {0.1, 500});
    const auto plain = scene::render(scene::room(), with(projection));
    Camera flipped = with(projection);
    flipped.rows = Rows::bottom_up;
    const auto upside_down = scene::render(scene::room(), flipped);
    Camera mirrored = with(projection);
    mirrored.view = Eigen::Vector4d(-1, 1, 1, 1).asDiagonal();
    const auto mirror = scene::render(scene::room(), mirrored);
    for (int y = 0; y < plain.height; ++y)
        for (int x = 0; x < plain.width; ++x) {
            const auto at = [&](int column, int row) { return static_cast<std::size_t>(row * plain.width + column); };
            REQUIRE(upside_down.z[at(x, plain.height - 1 - y)] == Approx(plain.z[at(x, y)]).epsilon(1e-10));
            REQUIRE(mirror.z[at(plain.width - 1 - x, y)] == Approx(plain.z[at(x, y)]).epsilon(1e-10));
        }
}

TEST_CASE("scene: codes are the stored value on the buffer's grid", "[scene]") {
    const Camera camera = with(perspective(std::numbers::pi / 3, 1.3, {0.1, 50}));
    const auto image = scene::render(scene::spheres(), camera);
    const auto d16 = scene::codes16(image, camera);
    const auto d24 = scene::codes24(image, camera);
    const auto floats = scene::read_back(image, DepthBits::d16);
    for (std::size_t i = 0; i < d16.size(); ++i) {
        REQUIRE(std::abs(d16[i] / 65535.0 - image.exact[i]) <= 0.5000001 / 65535);
        REQUIRE(std::abs(d24[i] / 16777215.0 - image.exact[i]) <= 0.5000001 / 16777215);
        REQUIRE(floats[i] == static_cast<float>(d16[i] / 65535.0));
    }
    CHECK(d16.front() == 0xFFFF); // the sky
    CHECK(d24.front() == 0xFFFFFF);
}
