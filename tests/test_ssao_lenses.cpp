// ssao through lenses, against rays into the scene, planes, and pinholes that look the same way. Rays of pixels are those of
// PixelRays, which test_pixel_rays.cpp checks.

#include "catch.hpp"
#include "images.hpp"
#include "lenses.hpp"
#include "parallel.hpp"
#include "ssao_call.hpp"
#include "test_device.hpp"

#include "lens/camera_lens.hpp"
#include "lens/faces.hpp"
#include "scene/scene.hpp"

#include <fathom/fathom.hpp>
#include <fathom/pixel_rays.hpp>

using namespace fathom;
using Eigen::Vector3d;

namespace {

// Of scenes: beside pinholes that look the same way with the same angle a pixel.
constexpr double over_pinholes = 0.002;
// The same of pixels at creases alone, relative.
constexpr double at_creases = 1.02;
// From a pixel to the next across the border of two blocks, and beside it, on smooth surfaces where the turned panorama has less than
// `no_step`.
constexpr double step_at_border = 0.01, no_step = 0.002;

// Is there depth all around a pixel? Where a plane ends, pixels have too few neighbours on it.
bool is_inside(const Camera& camera, const std::vector<float>& depth, int x, int y) {
    constexpr int around = 4;
    for (int j = std::max(y - around, 0); j <= std::min(y + around, camera.height - 1); ++j)
        for (int i = std::max(x - around, 0); i <= std::min(x + around, camera.width - 1); ++i)
            if (std::isnan(depth[static_cast<std::size_t>(j * camera.width + i)]))
                return false;
    return true;
}

// Near the rim of a whole circle, where an equisolid lens sees straight back and its rays turn without end.
bool is_behind(const Camera& camera, const Vector3d& ray) {
    return camera.lens->law == LensLaw::equisolid &&
           forwards_of(camera) * ray.z() < std::cos(155 * std::numbers::pi / 180);
}

struct Point {
    Vector3d position, normal;
};

// The fraction of a hemisphere's rays, weighted by the cosine, that meet nothing.
double rays_into(const scene::Scene& scene, const Point& point, double radius, int rays = 128) {
    const Vector3d right = point.normal.unitOrthogonal(), down = point.normal.cross(right);
    int open = 0;
    for (int i = 0; i < rays; ++i) {
        const double square = (i + 0.5) / rays, angle = 2 * std::numbers::pi * 0.6180339887498949 * i;
        const double across = std::sqrt(square);
        const Vector3d along =
            across * (std::cos(angle) * right + std::sin(angle) * down) + std::sqrt(1 - square) * point.normal;
        open += !scene::blocked(scene, point.position + 1e-6 * point.normal, along, radius);
    }
    return 1.0 * open / rays;
}

// What each pixel of a camera sees of a scene that is turned before it.
struct Seen {
    std::vector<float> depth;
    std::vector<std::optional<Point>> points;
};

Seen seen_by(const scene::Scene& scene, const Camera& camera,
             const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity()) {
    Seen seen;
    for (const PixelRay& ray : all_rays(camera)) {
        const auto met = ray ? scene::met(scene, {{0, 0, 0}, turn * in_scene(camera, *ray), 1e-6, 1e6})
                             : std::optional<scene::Met>();
        const auto part = ray ? part_stored(camera, *ray) : std::nullopt;
        seen.depth.push_back(!ray || !part ? no_depth
                             : met         ? static_cast<float>(met->position.norm() * *part)
                                           : std::numeric_limits<float>::infinity());
        seen.points.push_back(met ? std::optional(Point{met->position, met->normal}) : std::nullopt);
    }
    return seen;
}

Camera panorama(int width) {
    const double pixels = width / (2 * std::numbers::pi);
    Camera camera;
    camera.width = width;
    camera.height = width / 2;
    camera.encoding = Encoding::ray_distance;
    camera.projection = perspective(1, 1, {1, 2}, {.view_axes = ViewAxes::opengl});
    camera.lens = LensModel{LensLaw::equirectangular, pixels, pixels, width / 2.0, width / 4.0};
    return camera;
}

// Root of the mean square error at every n-th pixel, weighted.
struct Mean {
    double sum = 0, weight = 0;

    void add(double off, double weighs) {
        sum += weighs * off * off;
        weight += weighs;
    }
    double root() const { return std::sqrt(sum / weight); }
};

// Which pixels are compared: every so many of a row and a column, or of these those beside a crease.
struct Compared {
    int apart = 1;
    bool creases = false;

    bool operator()(const Camera& camera, const Seen& seen, int x, int y) const {
        const auto at = [&](int column, int row) -> const std::optional<Point>& {
            return seen.points[static_cast<std::size_t>(row * camera.width + column)];
        };
        const std::optional<Point>& here = at(x, y);
        if (!here)
            return false;
        if (!creases)
            return true;
        constexpr double together = 0.03, parallel = 0.7; // of the distance; cosine
        const auto beside = [&](int column, int row) {
            const bool inside = column >= 0 && row >= 0 && column < camera.width && row < camera.height;
            return inside && at(column, row) && at(column, row)->normal.dot(here->normal) < parallel &&
                   (at(column, row)->position - here->position).norm() < together * here->position.norm();
        };
        return beside(x - 1, y) || beside(x + 1, y) || beside(x, y - 1) || beside(x, y + 1);
    }
};

double error_of_panorama(const Device& device, const scene::Scene& scene, int width, double radius,
                         const SsaoOptions& options, const Compared& compared) {
    const int apart = compared.apart;
    const Camera camera = panorama(width);
    const Seen seen = seen_by(scene, camera);
    const std::vector<float> found =
        images::floats(ssao(depth_of(device, camera, seen.depth), radius, options).visibility);
    Mean mean;
    for (int y = apart / 2; y < camera.height; y += apart)
        for (int x = apart / 2; x < camera.width; x += apart) {
            const auto i = static_cast<std::size_t>(y * camera.width + x);
            if (compared(camera, seen, x, y))
                mean.add(static_cast<double>(found[i]) - rays_into(scene, *seen.points[i], radius),
                         std::sin((y + 0.5) / camera.height * std::numbers::pi));
        }
    return mean.root();
}

// The same of six faces of a cube that see 130 degrees, as dense in their middles.
double error_of_faces(const Device& device, const scene::Scene& scene, int width, double radius,
                      const SsaoOptions& options, const Compared& compared) {
    const int apart = compared.apart;
    const double focal = width / (2 * std::numbers::pi);
    const int half = static_cast<int>(std::tan(65 * std::numbers::pi / 180) * focal), inner = static_cast<int>(focal);
    Camera camera;
    camera.width = camera.height = 2 * half;
    camera.encoding = Encoding::ray_distance;
    camera.projection = perspective(Intrinsics{focal, focal, 1.0 * half, 1.0 * half, 2 * half, 2 * half}, {1, 2},
                                    {.view_axes = ViewAxes::opengl});
    Mean mean;
    for (const Eigen::Matrix3d& turn : scene::cube_turns()) {
        const Seen seen = seen_by(scene, camera, turn);
        const std::vector<float> found =
            images::floats(ssao(depth_of(device, camera, seen.depth), radius, options).visibility);
        for (int y = half - inner; y < half + inner; y += apart)
            for (int x = half - inner; x < half + inner; x += apart) {
                const auto i = static_cast<std::size_t>(y * camera.width + x);
                const double aside = (x + 0.5 - half) / focal, above = (y + 0.5 - half) / focal;
                if (compared(camera, seen, x, y))
                    mean.add(static_cast<double>(found[i]) - rays_into(scene, *seen.points[i], radius),
                             std::pow(1 + aside * aside + above * above, -1.5));
            }
    }
    return mean.root();
}

} // namespace

TEST_CASE("ssao lenses: planes are open through every lens", "[ssao][lens]") {
    const Device device = test_device();
    for (const auto& [name, plain] : lens_subjects()) {
        const std::vector<PixelRay> rays = all_rays(plain);
        const PixelScale scale = pixel_scale(plain);
        for (const bool along_axis : {false, true}) {
            Camera camera = plain;
            camera.encoding = along_axis ? Encoding::view_z : Encoding::ray_distance;
            double worst = 0;
            long wrong = 0, beyond = 0, all = 0;
            for (const Vector3d& wall : walls_around(camera)) {
                const std::vector<float> depth = depth_of_wall(camera, rays, wall, 0.1);
                for (const Quality quality : {Quality::fast, Quality::balanced}) {
                    const std::vector<float> found = images::floats(
                        ssao(depth_of(device, camera, depth), 0.5, {.sampling = Sampling{.quality = quality}})
                            .visibility);
                    for (std::size_t i = 0; i < depth.size(); ++i) {
                        wrong += std::isnan(depth[i]) != std::isnan(found[i]);
                        const int x = static_cast<int>(i) % camera.width, y = static_cast<int>(i) / camera.width;
                        if (std::isnan(found[i]) || !is_inside(camera, depth, x, y) ||
                            !is_regular(camera, scale, rays, x, y) || is_behind(camera, *rays[i]))
                            continue;
                        worst = std::max(worst, std::abs(1 - static_cast<double>(found[i])));
                        beyond += !(std::abs(1 - static_cast<double>(found[i])) <= ssao_plane_error);
                        ++all;
                    }
                }
            }
            std::printf("planes through %-42s %-4s off %.5f at most, %ld of %ld beyond %.3f\n", name.c_str(),
                        along_axis ? "axis" : "ray", worst, beyond, all, ssao_plane_error);
            INFO(name << (along_axis ? ", view-z" : ", ray-distance"));
            CHECK(wrong == 0);
            CHECK(worst <= ssao_plane_error);
        }
    }
}

TEST_CASE("ssao lenses: a panorama is as exact as pinholes that look the same way", "[ssao][lens][slow]") {
    const Device device = test_device();
    constexpr int width = 1024;
    constexpr double radius = 0.4;
    // The few pixels at edges decide, and the spheres lie in rows and columns of them.
    for (const auto& [name, apart] : {std::pair{"room", 4}, {"corridor", 4}, {"spheres", 1}}) {
        const SsaoOptions options{.sampling = Sampling{.quality = Quality::accurate}};
        const double off = error_of_panorama(device, scene::named(name), width, radius, options, {apart}),
                     of_faces = error_of_faces(device, scene::named(name), width, radius, options, {apart});
        std::printf("panorama of %-8s: rms error %.4f, of pinholes %.4f\n", name, off, of_faces);
        INFO(name);
        CHECK(off <= of_faces + over_pinholes);
    }
}

namespace {

constexpr double dot = 0.12, crease_rms[] = {0.032, 0.032, 0.028}; // of fast and balanced measured, 0.028 is wanted

/// What encloses the camera, 4 x 2.6 x 4.8.
scene::Scene box() {
    scene::Scene scene;
    for (const Vector3d& wall : {Vector3d(2, 0, 0), Vector3d(0, 1.3, 0), Vector3d(0, 0, 2.4)})
        for (const int side : {-1, 1})
            scene.push_back(scene::Plane{side * wall, -side * wall.normalized()});
    return scene;
}

} // namespace

TEST_CASE("ssao lenses: creases of a panorama show no dots", "[ssao][lens][slow]") {
    const Device device = test_device();
    constexpr double radius = 0.4;
    const scene::Scene scene = box();
    for (const int width : {960, 1024, 2048}) {
        const Camera camera = panorama(width);
        const Seen seen =
            seen_by(scene, camera, Eigen::AngleAxisd(0.3, Vector3d(0.2, 1, 0).normalized()).toRotationMatrix());
        std::vector<std::pair<std::size_t, double>> truth;
        int creases = 0;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < width; ++x)
                if (Compared{.creases = true}(camera, seen, x, y) && ++creases % 5 == 0)
                    truth.emplace_back(static_cast<std::size_t>(y * width + x), 0);
        oracle::in_parallel(truth.size(), [&](std::size_t k) {
            truth[k].second = rays_into(scene, *seen.points[truth[k].first], radius, 4096);
        });
        CHECK(creases > 3000);
        for (const Quality quality : qualities) {
            const std::vector<float> found = images::floats(
                ssao(depth_of(device, camera, seen.depth), radius, {.sampling = Sampling{.quality = quality}})
                    .visibility);
            Mean mean;
            int dots = 0;
            double worst = 0;
            for (const auto& [at, visibility] : truth) {
                const double off = static_cast<double>(found[at]) - visibility;
                dots += std::abs(off) > dot;
                worst = std::max(worst, std::abs(off));
                mean.add(off, 1);
            }
            std::printf("creases of a box, %d pixels around, %s: of %zu pixels %d are off by over %.2f, worst %.3f, "
                        "rms error %.4f\n",
                        width, quality_names[static_cast<int>(quality)], truth.size(), dots, dot, worst, mean.root());
            CHECK(mean.root() <= crease_rms[static_cast<int>(quality)]);
            CHECK(worst <= dot);
        }
    }
}

TEST_CASE("ssao lenses: creases of a panorama are as exact as those that pinholes see", "[ssao][lens][slow]") {
    const Device device = test_device();
    constexpr int width = 1024;
    constexpr double radius = 0.4;
    for (const char* name : {"room", "corridor"}) {
        const SsaoOptions options{.sampling = Sampling{.quality = Quality::accurate}};
        const Compared creases{.creases = true};
        const double off = error_of_panorama(device, scene::named(name), width, radius, options, creases),
                     of_faces = error_of_faces(device, scene::named(name), width, radius, options, creases);
        std::printf("creases of %-8s: rms error %.4f, of pinholes %.4f\n", name, off, of_faces);
        INFO(name);
        CHECK(off <= at_creases * of_faces);
    }
}

namespace {

// Which block of the lens's image each pixel lies in.
std::vector<int> blocks_of_pixels(const Camera& camera) {
    std::vector<int> blocks(static_cast<std::size_t>(camera.width * camera.height));
    int count = 0;
    for (const lens::Face& face : lens::faces_of(lens::CameraLens(camera), camera.width, camera.height, false)) {
        for (int y = face.block.top; y < face.block.bottom; ++y)
            for (int x = face.block.left; x < face.block.right; ++x)
                blocks[static_cast<std::size_t>(y * camera.width + x)] = count;
        ++count;
    }
    return blocks;
}

} // namespace

TEST_CASE("ssao lenses: no step shows where two blocks meet", "[ssao][lens]") {
    const Device device = test_device();
    const Camera camera = panorama(1024);
    const std::vector<int> blocks = blocks_of_pixels(camera);
    constexpr int columns = 37, around = 2;
    constexpr double flat = 0.005; // of inverse depth, relative: how much it may bend from pixel to pixel
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(-2 * std::numbers::pi * columns / camera.width, Vector3d::UnitY()).toRotationMatrix();
    for (const char* name : {"room", "corridor", "spheres"}) {
        const scene::Scene scene = scene::named(name);
        const Seen straight = seen_by(scene, camera), turned = seen_by(scene, camera, turn);
        const auto visible = [&](const Seen& seen) {
            return images::floats(
                ssao(depth_of(device, camera, seen.depth), 0.4, {.sampling = Sampling{.quality = Quality::accurate}})
                    .visibility);
        };
        const std::vector<float> one = visible(straight), other = visible(turned);
        const auto at = [&](int x, int y) {
            return static_cast<std::size_t>(y * camera.width + (x + 2 * camera.width) % camera.width);
        };
        const auto bends = [&](int x, int y, int dx, int dy) {
            const auto inverse = [&](int i) {
                return 1 / static_cast<double>(straight.depth[at(x + i * dx, y + i * dy)]);
            };
            return !(std::abs(inverse(1) + inverse(-1) - 2 * inverse(0)) < flat * inverse(0));
        };
        const auto is_smooth = [&](int x, int y) {
            for (int j = -around; j <= around + 1; ++j)
                for (int i = -around; i <= around + 1; ++i)
                    if (bends(x + i, y + j, 1, 0) || bends(x + i, y + j, 0, 1))
                        return false;
            return true;
        };
        constexpr int beside = 4; // pixels on either side, where one block's result passes over into the other's
        double most = 0, most_beside = 0;
        int steps = 0;
        for (int y = around + 1; y + around + 2 < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x)
                for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
                    const std::size_t here = at(x, y), next = at(x + dx, y + dy), there = at(x - columns, y),
                                      behind = at(x - columns + dx, y + dy);
                    const bool across = blocks[here] != blocks[next];
                    // The turned image is even here, and around steps that only lie beside a border.
                    bool meet = false, even = true;
                    for (int i = -beside; i < beside; ++i)
                        if (const int row = y + i * dy; row >= 0 && row + dy < camera.height) {
                            meet |= blocks[at(x + i * dx, row)] != blocks[at(x + (i + 1) * dx, row + dy)];
                            if (i == 0 || !across)
                                even &= std::abs(other[at(x + (i + 1) * dx - columns, row + dy)] -
                                                 other[at(x + i * dx - columns, row)]) <= no_step;
                        }
                    if (!meet || !even || blocks[there] != blocks[behind] || !is_smooth(x, y))
                        continue;
                    const double step = std::abs(static_cast<double>(one[next]) - static_cast<double>(one[here]));
                    (across ? most : most_beside) = std::max(across ? most : most_beside, step);
                    steps += across;
                }
        std::printf("borders of blocks in %-8s: %d steps, at most %.4f, beside them %.4f\n", name, steps, most,
                    most_beside);
        CHECK(steps > 1000);
        CHECK(most <= step_at_border);
        CHECK(most_beside <= step_at_border);
    }
}

namespace {

// What all options of a call give, of a room.
struct Room {
    Camera camera = panorama(256);
    std::vector<float> depth, back, thickness;
    std::vector<float> directions; // in the world

    Room() {
        camera.view = Eigen::Matrix4d::Identity();
        camera.view->topLeftCorner<3, 3>() =
            Eigen::AngleAxisd(0.7, Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
        const Seen seen = seen_by(scene::room(), camera);
        depth = seen.depth;
        for (std::size_t i = 0; i < depth.size(); ++i) {
            thickness.push_back(0.05f + 0.01f * static_cast<float>(i % 7));
            back.push_back(depth[i] + thickness.back());
            const Vector3d normal = camera.view->topLeftCorner<3, 3>().transpose() *
                                    (seen.points[i] ? seen.points[i]->normal : Vector3d::Zero());
            for (const double each : normal)
                directions.push_back(static_cast<float>(each));
        }
    }

    Layout layout(int channels = 1) const { return {camera.width, camera.height, channels}; }
    StoredDepth stored(const Device& device) const { return depth_of(device, camera, depth); }
};

} // namespace

TEST_CASE("ssao lenses: thickness, a second layer and normals count through a lens", "[ssao][lens]") {
    const Room room;
    const Device device = test_device();
    const auto visible = [&](const SsaoOptions& options) {
        return images::floats(ssao(room.stored(device), 0.5, options).visibility);
    };
    const Image map = Image::from_host(device, Element::f32, room.thickness.data(), room.layout());
    const std::vector<float> mapped = visible({.thickness = map}),
                             backed = visible({.thickness = depth_of(device, room.camera, room.back)}),
                             thin = visible({.thickness = 0.0}), plain = visible({}),
                             constant = visible({.thickness = 0.125});
    // A second layer along the rays is a thickness of each pixel.
    CHECK(images::difference(mapped, backed).rmse < 1e-3);
    CHECK(images::difference(mapped, thin).rmse > 0.005);
    CHECK(images::difference(plain, constant).rmse > 0.001);
    // The scene's own normals, in the world.
    const std::vector<float> given =
        visible({.normals = Image::from_host(device, Element::f32, room.directions.data(), room.layout(3)),
                 .normals_space = Space::world});
    std::printf("normals that are given, and those from the depth: %.4f rms\n", images::difference(plain, given).rmse);
    CHECK(images::difference(plain, given).rmse < 0.05);
    // Coarse depth: planes are fitted.
    std::vector<std::uint16_t> codes;
    for (const float each : room.depth)
        codes.push_back(static_cast<std::uint16_t>(std::lround(each * 1000)));
    Camera millimetres = room.camera;
    millimetres.scale = 0.001;
    const std::vector<float> coarse = images::floats(
        ssao({Image::from_host(device, Element::u16, codes.data(), room.layout()), millimetres, Storage::uint16}, 0.5)
            .visibility);
    std::printf("depth in millimetres: %.4f rms\n", images::difference(plain, coarse).rmse);
    CHECK(images::difference(plain, coarse).rmse < 0.05);
}

TEST_CASE("ssao lenses: bent normals are the mean open directions in the camera's axes", "[ssao][lens]") {
    // A floor alone is open all around, so they are its normal.
    const Device device = test_device();
    const Camera camera = panorama(256);
    std::vector<float> depth;
    for (const PixelRay& ray : all_rays(camera))
        depth.push_back(ray->y() < -0.15 ? static_cast<float>(-1.5 / ray->y())
                                         : std::numeric_limits<float>::infinity());
    const Occlusion found = ssao(depth_of(device, camera, depth), 0.4, {.bent_normal = true});
    const std::vector<float> bent = images::floats(found.bent_normal);
    double sum = 0;
    long count = 0;
    for (std::size_t i = 0; i < depth.size(); ++i)
        if (std::isfinite(depth[i])) {
            sum += std::acos(std::min(1.0, static_cast<double>(bent[3 * i + 1])));
            ++count;
        }
    const double mean = sum / static_cast<double>(count) * 180 / std::numbers::pi;
    std::printf("bent normals of a floor: %.2f degrees on average\n", mean);
    CHECK(mean < 1);
}

TEST_CASE("ssao lenses: what cannot be is told", "[ssao][lens]") {
    const Room room;
    const Device device = test_device();
    CHECK_THROWS_WITH(ssao(room.stored(device), 0.5, {.border = Border::clamp}), ContainsSubstring("border clamp"));
    Camera other = room.camera;
    other.lens->fx *= 1.01;
    CHECK_THROWS_WITH(ssao(room.stored(device), 0.5, {.thickness = depth_of(device, other, room.back)}),
                      ContainsSubstring("other rays"));
    const StoredDepth little = room.stored(test_device({.memory_budget = 100000}));
    CHECK_THROWS_WITH(ssao(little, 0.5), ContainsSubstring("ssao of 256 x 128 pixels through a lens"));
    const std::size_t enough = bytes(Tile(room.stored(device)), SsaoOptions{});
    CHECK(images::same_bits(images::floats(ssao(room.stored(test_device({.memory_budget = enough})), 0.5).visibility),
                            images::floats(ssao(room.stored(device), 0.5).visibility)));
}
