// Lenses: the field of view, a distortion until it folds within the image, the latitude of a panorama, and the radius of ambient
// occlusion over the distance of what is nearest. A box is seen from inside, so that there are walls and creases in every direction.

#include "images.hpp"
#include "regimes/regime.hpp"
#include "scene/scene.hpp"

#include <fathom/pixel_rays.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

namespace fathom::regimes {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr const char* of_normals = "mean error of normals, degrees";
constexpr const char* of_visibility = "error of visibility, rms";
constexpr double plane_normal = 0.003; // degrees on average
constexpr const char* without_ray = "pixels without a ray, percent";

const scene::Scene& box() {
    static const scene::Scene all{scene::Box{{0.3, 0.1, -0.8}, {2, 1.1, 2.5}}}; // from 1 to 3.3 away
    return all;
}

Camera camera_through(const LensModel& lens, int width, int height) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.encoding = Encoding::ray_distance;
    camera.lens = lens;
    return camera;
}

Camera panorama(int width) {
    const double pixels = width / (2 * pi);
    return camera_through({LensLaw::equirectangular, pixels, pixels, width / 2.0, width / 4.0}, width, width / 2);
}

// A share of the hemisphere's rays, weighted by the cosine, that meet nothing.
double open_share(const Vector3d& position, const Vector3d& normal, double radius) {
    constexpr int rays = 256;
    const Vector3d right = normal.unitOrthogonal(), down = normal.cross(right);
    int open = 0;
    for (int i = 0; i < rays; ++i) {
        const double square = (i + 0.5) / rays, angle = 2 * pi * 0.6180339887498949 * i;
        const Vector3d along =
            std::sqrt(square) * (std::cos(angle) * right + std::sin(angle) * down) + std::sqrt(1 - square) * normal;
        open += !scene::blocked(box(), position + 1e-6 * normal, along, radius);
    }
    return 1.0 * open / rays;
}

SsaoOptions of_quality(Quality quality) {
    SsaoOptions options{.sampling = Sampling{.quality = quality}};
    options.thickness = std::numeric_limits<double>::infinity(); // of walls
    return options;
}

struct LensErrors {
    double normals = 0, visibility = 0; // degrees on average, and the root of the mean square
    double no_ray = 0;                  // part of the pixels
};

// Of the pixels that are `wanted` by their ray.
LensErrors lens_errors(const Device& device, const Camera& camera, double radius, Quality quality,
                       const std::function<bool(const Vector3d& ray)>& wanted) {
    constexpr int apart = 5, beside = 2; // pixels between those whose visibility is judged, and to the nearest edge
    const PixelRays rays(camera);
    const scene::Rendered seen = scene::render(box(), camera, [&](double x, double y) { return rays.ray_of(x, y); });
    const StoredDepth stored = images::stored_of(device, seen.stored, camera);
    const std::vector<float> normal = images::floats(normals(stored)),
                             visibility = images::floats(ssao(stored, radius, of_quality(quality)).visibility);
    const auto index = [&](int x, int y) { return static_cast<std::size_t>(y * camera.width + x); };
    const auto is_inside = [&](int x, int y) {
        for (const int i : {-beside, 0, beside})
            for (const int j : {-beside, 0, beside})
                if (x + i < 0 || y + j < 0 || x + i >= camera.width || y + j >= camera.height ||
                    !(seen.normal[index(x + i, y + j)].dot(seen.normal[index(x, y)]) > 0.999))
                    return false;
        return true;
    };
    double degrees = 0, squares = 0;
    int flat = 0, judged = 0;
    LensErrors errors;
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const std::size_t i = index(x, y);
            const auto ray = rays.ray_of(x + 0.5, y + 0.5);
            errors.no_ray += ray ? 0 : 1.0 / (camera.width * camera.height);
            if (!ray || !wanted(*ray))
                continue;
            if (is_inside(x, y)) {
                const Vector3d found = Eigen::Map<const Eigen::Vector3f>(&normal[3 * i]).cast<double>();
                degrees += std::atan2(found.cross(seen.normal[i]).norm(), found.dot(seen.normal[i])) * 180 / pi;
                ++flat;
            }
            if (x % apart == 2 && y % apart == 2) {
                squares += std::pow(
                    static_cast<double>(visibility[i]) - open_share(seen.position[i], seen.normal[i], radius), 2);
                ++judged;
            }
        }
    errors.normals = degrees / flat;
    errors.visibility = std::sqrt(squares / judged);
    return errors;
}

} // namespace

Regime field_of_view(const Device& device) {
    Regime regime{"field-of-view", "field of view, degrees"};
    constexpr int side = 180;
    for (const double degrees : {10.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0, 210.0, 240.0, 270.0, 300.0, 330.0, 355.0})
        for (const auto& [name, law] : {std::pair{"equidistant", LensLaw::equidistant},
                                        {"equisolid", LensLaw::equisolid},
                                        {"stereographic", LensLaw::stereographic}}) {
            const double half = degrees * pi / 360, radius = law == LensLaw::equidistant ? half
                                                             : law == LensLaw::equisolid ? 2 * std::sin(half / 2)
                                                                                         : 2 * std::tan(half / 2);
            const double f = side / 2.0 / radius;
            const Camera camera = camera_through({law, f, f, side / 2.0, side / 2.0}, side, side);
            const LensErrors errors =
                lens_errors(device, camera, 0.5, Quality::balanced,
                            [least = std::cos(half)](const Vector3d& ray) { return -ray.z() > least; });
            regime.panel(of_normals).curve(name).points.push_back({degrees, errors.normals});
            regime.panel(of_visibility).curve(name).points.push_back({degrees, errors.visibility});
        }
    // In narrow views what occludes lies outside of the image.
    regime.boundaries = {
        {of_normals, "equidistant", plane_normal, 270, 300, "promised (lenses)"},
        {of_normals, "equisolid", plane_normal, 180, 210, "promised (lenses)"},
        {of_normals, "stereographic", plane_normal, 180, 210, "promised (lenses)"},
        {of_visibility, "equidistant", 0.03, 60, 30, "measured", none, 30},
        {of_visibility, "equisolid", 0.03, 270, 300, "measured", 60},
        {of_visibility, "stereographic", 0.03, 240, 270, "measured", 60, 300},
    };
    return regime;
}

Regime distortion(const Device& device) {
    Regime regime{"distortion", "-k1"};
    constexpr int width = 240, height = 180; // whose corners are 0.8 focal lengths away
    constexpr double f = 150 / 0.8;
    for (const double k : {0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.22, 0.23, 0.24, 0.25, 0.3, 0.4, 0.5}) {
        const Camera camera =
            camera_through({LensLaw::brown, f, f, width / 2.0, height / 2.0, {-k, 0, 0, 0}}, width, height);
        const LensErrors errors =
            lens_errors(device, camera, 0.5, Quality::balanced, [](const Vector3d&) { return true; });
        regime.panel(without_ray).curve("brown").points.push_back({k, 100 * errors.no_ray});
        regime.panel(of_normals).curve("brown").points.push_back({k, errors.normals});
    }
    regime.boundaries = {
        {without_ray, "brown", 0.05, 0.23, 0.24, "derived: 2/3 sqrt(-1/(3 k1)) is 0.8"},
        {of_normals, "brown", 0.005, 0.3, 0.4, "measured"},
    };
    return regime;
}

Regime latitude_of_a_panorama(const Device& device) {
    Regime regime{"latitude", "latitude, degrees"};
    for (const double degrees : {0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 87.0}) {
        const LensErrors errors = lens_errors(device, panorama(360), 1.4, Quality::balanced, [&](const Vector3d& ray) {
            return std::abs(std::asin(std::abs(ray.y())) * 180 / pi - degrees) < 3;
        });
        regime.panel(of_normals).curve("panorama").points.push_back({degrees, errors.normals});
        regime.panel(of_visibility).curve("panorama").points.push_back({degrees, errors.visibility});
    }
    regime.boundaries = {
        {of_normals, "panorama", plane_normal, 0, none, "promised (lenses)"},
        {of_visibility, "panorama", 0.03, 0, none, "measured"},
    };
    return regime;
}

Regime radius_over_distance(const Device& device) {
    Regime regime{"radius-over-distance", "radius / nearest distance"};
    constexpr double nearest = 1; // the floor
    for (const auto& [name, quality] :
         {std::pair{"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}})
        for (const double radius : {0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0})
            regime.panel(of_visibility)
                .curve(name)
                .points.push_back(
                    {radius / nearest, lens_errors(device, panorama(360), radius, quality, [](const Vector3d&) {
                                           return true;
                                       }).visibility});
    regime.boundaries = {
        {of_visibility, "fast", 0.032, 0.2, 0.1, "measured", 2},
        {of_visibility, "balanced", 0.032, 0.2, 0.1, "measured", 2},
        {of_visibility, "accurate", 0.032, 2, 3, "measured"},
    };
    return regime;
}

} // namespace fathom::regimes
