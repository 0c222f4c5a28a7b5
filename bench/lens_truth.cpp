// A thin lens: rays through a point L of the lens meet at the depth in focus S, so a surface at z is seen beside the pinhole's
// ray by L (1 − z/S), a circle of 2|L| fx |1/z − 1/S| pixels: k = 2|L| fx/S. Orthographic rays: L (z − S)/S, g = 2|L|/S pixels.

#include "lens_truth.hpp"

#include "parallel.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace fathom::bench {
namespace {

constexpr int lens_rays = 1024;

// Evenly in the unit disc: sunflower seeds.
Eigen::Vector2d on_disc(int i) {
    const double radius = std::sqrt((i + 0.5) / lens_rays);
    const double angle = 2 * std::numbers::pi * i / (std::numbers::phi * std::numbers::phi);
    return {radius * std::cos(angle), radius * std::sin(angle)};
}

// Evenly in a pixel, unlike the sequence above: a lattice of the plastic number.
Eigen::Vector2d in_pixel(int i) {
    constexpr double plastic = 1.32471795724474602596;
    const auto part = [](double value) { return value - std::floor(value); };
    return {part(0.5 + i / plastic), part(0.5 + i / (plastic * plastic))};
}

} // namespace

std::vector<float> picture_of(const View& view) {
    const Camera& camera = view.camera();
    const scene::Caster caster(view.scene, camera);
    const Eigen::Matrix4d world = scene::to_world(camera);
    std::vector<float> picture(3 * static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
    constexpr double places[][2] = {{0.125, 0.625}, {0.375, 0.125}, {0.625, 0.875}, {0.875, 0.375}};
    const auto width = static_cast<std::size_t>(camera.width);
    oracle::in_parallel(static_cast<std::size_t>(camera.height), [&](std::size_t y) {
        for (std::size_t x = 0; x < width; ++x) {
            Eigen::Vector3d sum = Eigen::Vector3d::Zero();
            for (const auto& [right, down] : places) {
                const auto surface = caster.at(static_cast<double>(x) + right, static_cast<double>(y) + down);
                sum += surface ? color_of(view, (world * surface->position.homogeneous()).head<3>(),
                                          world.topLeftCorner<3, 3>() * surface->normal)
                               : sky_color();
            }
            for (std::size_t i = 0; i < 3; ++i)
                picture[3 * (y * width + x) + i] = static_cast<float>(sum[static_cast<Eigen::Index>(i)] / 4);
        }
    });
    return picture;
}

LensTruth::LensTruth(const View& view, const CircleOfConfusion& circle)
    : view_(view), caster_(view.scene, view.camera()), to_world_(scene::to_world(view.camera())),
      perspective_(view.camera().projection.is_perspective()) {
    const Projection& p = view.camera().projection;
    const double per_unit = static_cast<double>(pixel_scale(view.camera()).x);
    focus_ = static_cast<double>(circle.telecentric ? circle.k / circle.g : circle.g / circle.k);
    const auto k = static_cast<double>(circle.k);
    lens_radius_ = circle.telecentric ? k / (2 * per_unit) : k * focus_ / (2 * per_unit);
    const long double sense = p.clip_far() > p.clip_near() ? 1 : -1;
    inside_ << (sense * (p.matrix.row(2) - p.clip_near() * p.matrix.row(3))).cast<double>(),
        (sense * (p.clip_far() * p.matrix.row(3) - p.matrix.row(2))).cast<double>();
}

Eigen::Vector3d LensTruth::along(double x, double y, const Eigen::Vector2d& on_lens) const {
    const scene::Ray pinhole = caster_.ray(x, y);
    const auto at_depth = [&](double z) { return pinhole.at((-z - pinhole.origin.z()) / pinhole.direction.z()); };
    const Eigen::Vector3d aside = lens_radius_ * Eigen::Vector3d(on_lens.x(), on_lens.y(), 0);
    const Eigen::Vector3d start = perspective_ ? pinhole.origin + aside : Eigen::Vector3d(at_depth(0) - aside);
    scene::Ray ray{start, at_depth(focus_) - start, 0, std::numeric_limits<double>::infinity()};
    if (!perspective_)
        ray.first = -ray.last;
    const Eigen::Vector2d start_inside = inside_ * ray.origin.homogeneous(),
                          growth = inside_.leftCols<3>() * ray.direction;
    for (int plane = 0; plane < 2; ++plane) {
        const double crossing = -start_inside[plane] / growth[plane];
        if (growth[plane] > 0)
            ray.first = std::max(ray.first, crossing);
        else if (growth[plane] < 0)
            ray.last = std::min(ray.last, crossing);
    }
    const scene::Ray world{(to_world_ * ray.origin.homogeneous()).head<3>(),
                           to_world_.topLeftCorner<3, 3>() * ray.direction, ray.first, ray.last};
    const auto met = scene::met(view_.scene, world);
    return met ? color_of(view_, met->position, met->normal) : sky_color();
}

Eigen::Vector3d LensTruth::at(int x, int y) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < lens_rays; ++i) {
        const Eigen::Vector2d place = in_pixel(i);
        sum += along(x + place.x(), y + place.y(), on_disc(i));
    }
    return sum / lens_rays;
}

} // namespace fathom::bench
