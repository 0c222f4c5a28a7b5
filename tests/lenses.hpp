#pragma once

#include <fathom/camera.hpp>
#include <fathom/lens.hpp>
#include <fathom/linearize.hpp>
#include <fathom/pixel_rays.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

/// Cameras with a lens of every law, for tests: from 60 degrees to a whole panorama, with folds inside the image and without.
struct LensSubject {
    std::string name;
    fathom::Camera camera;
};

inline std::vector<LensSubject> lens_subjects() {
    using namespace fathom;
    using enum LensLaw;
    constexpr double pi = 3.14159265358979323846;
    const auto camera = [](LensModel lens, int width, int height) { // of half that size
        for (double* const each : {&lens.fx, &lens.fy, &lens.cx, &lens.cy})
            *each /= 2;
        Camera result;
        result.width = width / 2;
        result.height = height / 2;
        result.encoding = Encoding::ray_distance;
        result.projection = perspective(1, 1, {1, 2}, {.view_axes = ViewAxes::opencv});
        result.lens = lens;
        return result;
    };
    std::vector<LensSubject> all{
        {"Azure Kinect",
         camera({brown, 504.9, 504.8, 326.2, 334, {5.6, 3.6, 7e-5, -9e-5, 0.19, 5.9, 5.4, 1}}, 640, 576)},
        {"brown, k1 = -0.35", camera({brown, 605, 605, 480, 270, {-0.35, 0.13, 0, 0, 0.01}}, 960, 540)},
        {"brown with a fold in the image",
         camera({brown, 500, 500, 480, 270, {-0.3, 0.1, 1e-3, -5e-4, -0.02}}, 960, 540)},
        {"brown with a thin prism",
         camera({brown, 500, 505, 480, 270, {-0.1, 0.02, 1e-3, -5e-4, 0, 0, 0, 0, 1e-3, 2e-4, -1e-3, 1e-4}}, 960, 540)},
        {"equidistant", camera({equidistant, 250, 250, 480, 270}, 960, 540)},
        {"equisolid", camera({equisolid, 362, 362, 512, 512}, 1024, 1024)},
        {"stereographic", camera({stereographic, 200, 200, 480, 270}, 960, 540)},
        {"OpenCV's fisheye", camera({opencv_fisheye, 310, 312, 512, 510, {0.05, -0.01, 0.002, -3e-4}}, 1024, 1024)},
        {"OpenCV's fisheye with a fold in the image",
         camera({opencv_fisheye, 310, 312, 512, 510, {0.05, -0.03, 0, 0}}, 1024, 1024)},
        {"double sphere", camera({double_sphere, 350, 350, 512, 512, {-0.2, 0.6}}, 1024, 1024)},
        {"Blender's polynomial",
         camera({blender_polynomial, 26.7, 26.7, 480, 270, {0, -0.0919, -0.0019, -0.00017, 0}}, 960, 540)},
        {"panorama", camera({equirectangular, 1024 / (2 * pi), 512 / pi, 512, 256}, 1024, 512)},
        {"part of a panorama", camera({equirectangular, 400, 420, -100, 500}, 700, 300)},
    };
    const auto again = [&](std::size_t i, const std::string& how) {
        all.push_back({all[i].name + how, all[i].camera});
        return &all.back().camera;
    };
    again(0, ", opengl")->projection.convention.view_axes = ViewAxes::opengl;
    again(3, ", directx")->projection.convention.view_axes = ViewAxes::directx;
    again(7, ", rows bottom up")->rows = Rows::bottom_up;
    again(11, ", opengl")->projection.convention.view_axes = ViewAxes::opengl;
    return all;
}

using PixelRay = std::optional<Eigen::Vector3d>;

inline std::vector<PixelRay> all_rays(const fathom::Camera& camera) {
    const fathom::PixelRays rays(camera);
    std::vector<PixelRay> all;
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x)
            all.push_back(rays.ray_of(x + 0.5, y + 0.5));
    return all;
}

// The rays of a camera's pixels as a map, of those that are kept.
inline fathom::RayMap mapped_rays(const fathom::Camera& camera, const std::function<bool(int x, int y)>& is_kept) {
    const fathom::ViewAxes axes = camera.projection.convention.view_axes;
    const Eigen::Vector3d signs(1, axes == fathom::ViewAxes::opencv ? 1 : -1,
                                axes == fathom::ViewAxes::opengl ? -1 : 1);
    const fathom::PixelRays rays(camera);
    fathom::RayMap map{camera.width, camera.height};
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            const auto ray = is_kept(x, y) ? rays.ray_of(x + 0.5, y + 0.5) : std::nullopt;
            for (int i = 0; i < 3; ++i)
                map.rays.push_back(ray ? static_cast<float>(signs[i] * (*ray)[i]) : 0.0f);
        }
    return map;
}
inline fathom::RayMap mapped_rays(const fathom::Camera& camera) {
    return mapped_rays(camera, [](int, int) { return true; });
}

inline double forwards_of(const fathom::Camera& camera) {
    return camera.projection.convention.view_axes == fathom::ViewAxes::opengl ? -1 : 1;
}

// The part of a ray along the view axis if depth counts along it, or 1; none beyond 89 degrees, whose depth says nothing.
inline std::optional<double> part_stored(const fathom::Camera& camera, const Eigen::Vector3d& ray) {
    if (camera.encoding == fathom::Encoding::ray_distance)
        return 1;
    const double ahead = forwards_of(camera) * ray.z();
    return ahead > std::cos(89 * std::numbers::pi / 180) * (1 + 1e-6) ? std::optional(ahead) : std::nullopt;
}

inline constexpr float no_depth = std::numeric_limits<float>::quiet_NaN();

inline fathom::StoredDepth depth_of(const fathom::Device& device, const fathom::Camera& camera,
                                    const std::vector<float>& values) {
    return {fathom::Image::from_host(device, fathom::Element::f32, values.data(), {camera.width, camera.height}),
            camera};
}

// Directions to walls that lie 2.5 away: ahead, almost below, and aside.
inline std::vector<Eigen::Vector3d> walls_around(const fathom::Camera& camera) {
    const double ahead = forwards_of(camera);
    return {Eigen::Vector3d(0.3, -0.2, ahead).normalized(), Eigen::Vector3d(0.1, -1, 0.2 * ahead).normalized(),
            Eigen::Vector3d(0.9, 0.3, -0.2).normalized()};
}

// The depth of such a wall, where its cosine to a ray is at least so large.
inline std::vector<float> depth_of_wall(const fathom::Camera& camera, const std::vector<PixelRay>& rays,
                                        const Eigen::Vector3d& wall, double least) {
    std::vector<float> depth;
    for (const PixelRay& ray : rays) {
        const auto part = ray ? part_stored(camera, *ray) : std::nullopt;
        const double across = ray ? wall.dot(*ray) : 0;
        depth.push_back(part && across > least ? static_cast<float>(2.5 / across * *part) : no_depth);
    }
    return depth;
}

// A camera that is turned and does not stand in the world's origin.
inline Eigen::Matrix4d turned_view() {
    Eigen::Isometry3d view = Eigen::Isometry3d::Identity();
    view.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -0.5).normalized()));
    view.translate(Eigen::Vector3d(-1.5, 2.25, 7));
    return view.matrix();
}

// From the axes of view space to those of the scenes, which are OpenGL's.
inline Eigen::Vector3d in_scene(const fathom::Camera& camera, const Eigen::Vector3d& vector) {
    const fathom::ViewAxes axes = camera.projection.convention.view_axes;
    return {vector.x(), axes == fathom::ViewAxes::opencv ? -vector.y() : vector.y(),
            axes == fathom::ViewAxes::opengl ? vector.z() : -vector.z()};
}

// Where rays turn like those on the axis: not within some pixels of a fold, where they turn without end, nor where those of
// neighbours meet behind the camera.
inline bool is_regular(const fathom::Camera& camera, const fathom::PixelScale& scale, const std::vector<PixelRay>& rays,
                       int x, int y) {
    constexpr int beside_fold = 8;
    constexpr double least_turn = 0.1;
    const auto at = [&](int column, int row) -> const PixelRay& {
        return rays[static_cast<std::size_t>(row * camera.width + column)];
    };
    if (x < 1 || y < 1 || x + 1 >= camera.width || y + 1 >= camera.height)
        return false;
    for (const int i : {-beside_fold, 0, beside_fold})
        for (const int j : {-beside_fold, 0, beside_fold})
            if (!at(std::clamp(x + i, 0, camera.width - 1), std::clamp(y + j, 0, camera.height - 1)))
                return false;
    const auto turn = [&](const PixelRay& a, const PixelRay& b) { return a && b ? (*a - *b).norm() / 2 : 0; };
    // The singular values of both slopes are no smaller than their product over their sum.
    const double across = turn(at(x - 1, y), at(x + 1, y)) * static_cast<double>(scale.x),
                 down = turn(at(x, y - 1), at(x, y + 1)) * static_cast<double>(scale.y);
    const Eigen::Vector3d a = *at(x + 1, y) - *at(x, y), b = *at(x, y + 1) - *at(x, y);
    const double area = a.cross(b).norm() * static_cast<double>(scale.x * scale.y);
    return area > least_turn * std::hypot(across, down);
}
