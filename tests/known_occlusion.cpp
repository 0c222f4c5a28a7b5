#include "known_occlusion.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace oracle {

using Eigen::Vector2d;
using Eigen::Vector3d;
using fathom::Camera;

namespace {

constexpr double pi = std::numbers::pi;
const fathom::scene::Plane ground{{0, 0, 0}, {0, 0, 1}};

/// From x = `near_x` to `far_x`, up to a height, infinite along y.
fathom::scene::Box block(double near_x, double far_x, double height) {
    return {{0.5 * (near_x + far_x), 0, 0}, {0.5 * std::abs(far_x - near_x), infinite, height}};
}

} // namespace

Known open_plane(double tilt, double towards) {
    const Vector3d normal(std::sin(tilt) * std::cos(towards), std::sin(tilt) * std::sin(towards), std::cos(tilt));
    return {.scene = {fathom::scene::Plane{{0, 0, 0}, normal}}, .visibility = 1, .normal = normal};
}

Known crease(double alpha, double distance) {
    const Vector3d up_the_other(-std::cos(alpha), 0, std::sin(alpha));
    return {.scene = {ground, fathom::scene::Plane{{distance, 0, 0}, {-std::sin(alpha), 0, -std::cos(alpha)}}},
            .visibility = 0.5 * (1 - std::cos(alpha)),
            .from = (up_the_other - Vector3d::UnitX()).normalized()};
}

Known corner(double distance_x, double distance_y) {
    return {.scene = {ground, fathom::scene::Plane{{distance_x, 0, 0}, {-1, 0, 0}},
                      fathom::scene::Plane{{0, distance_y, 0}, {0, -1, 0}}},
            .visibility = 0.25,
            .from = Vector3d(-1, -1, 1).normalized()};
}

Known wall(double height, double distance) {
    return {.scene = {ground, block(distance, 1.2 * distance, height)},
            .visibility = 0.5 * (1 + distance / std::hypot(distance, height)),
            .from = Vector3d(-1, 0, 2).normalized()};
}

Known infinite_wall(double distance, double radius) {
    Known known = crease(pi / 2, distance);
    const double theta = std::acos(std::min(1.0, distance / radius));
    known.visibility = 1 - (theta - std::sin(theta) * std::cos(theta)) / pi;
    known.radius = radius;
    return known;
}

Known trench(double left, double left_height, double right, double right_height) {
    return {.scene = {ground, block(-left, -3 * left, left_height), block(right, 3 * right, right_height)},
            .visibility = 0.5 * (right / std::hypot(right, right_height) + left / std::hypot(left, left_height))};
}

Known bowl(double radius, double depth, double polar) {
    const Vector3d centre(0, 0, radius), outward(std::sin(polar), 0, -std::cos(polar));
    return {.scene = {fathom::scene::Bowl{centre, radius, {0, 0, 1}, depth}},
            .visibility = 1 - depth / (2 * radius),
            .position = centre + radius * outward,
            .normal = -outward};
}

Known uniform_horizon(double elevation) {
    const double rim = std::tan(elevation);
    return {.scene = {fathom::scene::Bowl{{0, 0, rim}, 1, {0, 0, 1}, 1},
                      fathom::scene::Disk{{0, 0, 0}, {0, 0, 1}, std::sqrt(std::max(0.0, 1 - rim * rim))}},
            .visibility = std::cos(elevation) * std::cos(elevation)};
}

std::vector<View> views(const Placement& placement) {
    using namespace fathom;
    const Vector3d& back = placement.from;
    const Vector3d up = std::abs(back.y()) < 0.9 ? Vector3d::UnitY() : Vector3d::UnitZ();
    const Vector3d right = up.cross(back).normalized();
    Eigen::Matrix4d look = Eigen::Matrix4d::Identity();
    look.row(0).head<3>() = right;
    look.row(1).head<3>() = back.cross(right);
    look.row(2).head<3>() = back;
    look.col(3).head<3>() = -look.topLeftCorner<3, 3>() * (placement.target + placement.distance * back);

    const double d = placement.distance, x = 0.5 * placement.extent, y = x * placement.height / placement.width;
    const double near = 0.05 * d, far = 50 * d, at_near = near / d;
    const auto edges = [](double left, double right_edge, double bottom, double top, double scale) {
        return FrustumEdges{left * scale, right_edge * scale, bottom * scale, top * scale};
    };
    const auto view = [&](const char* name, const Projection& projection, Rows rows) {
        const ViewAxes axes = projection.convention.view_axes;
        const Eigen::Vector4d own(1, axes == ViewAxes::opencv ? -1 : 1, axes == ViewAxes::opengl ? 1 : -1, 1);
        Camera camera;
        camera.projection = projection;
        camera.width = placement.width;
        camera.height = placement.height;
        camera.rows = rows;
        camera.view = own.asDiagonal() * look;
        return View{name, camera};
    };
    const Convention opencv{ClipZ::zero_to_one, ClipY::down, ViewAxes::opencv};
    const Projection plain = perspective(edges(-x, x, -y, y, at_near), {near, far});
    return {
        view("perspective", plain, Rows::top_down),
        view("off-centre", perspective(edges(-0.5 * x, 1.5 * x, -1.4 * y, 0.6 * y, at_near), {near, far}, opencv),
             Rows::top_down),
        view("oblique", with_oblique_near_plane(plain, {0.2, 0.1, -1, -2 * near}), Rows::bottom_up),
        view("infinite reversed",
             perspective(edges(-x, x, -y, y, at_near), {near, infinite, DepthOrder::reversed}, Convention::vulkan()),
             Rows::top_down),
        view("orthographic", orthographic(edges(-x, x, -y, y, 1), {0, far}, Convention::direct3d()), Rows::bottom_up)};
}

Vector2d pixel_of(const Camera& camera, const Vector3d& world) {
    const Eigen::Vector4d in_view = fathom::scene::to_world(camera).inverse() * world.homogeneous();
    const Eigen::Vector4d clip = camera.projection.matrix.cast<double>() * in_view;
    const double x = clip.x() / clip.w(), y = clip.y() / clip.w();
    const bool grows_down =
        (camera.projection.convention.clip_y == fathom::ClipY::down) == (camera.rows == fathom::Rows::top_down);
    return {0.5 * (1 + x) * camera.width, 0.5 * (1 + (grows_down ? y : -y)) * camera.height};
}

} // namespace oracle
