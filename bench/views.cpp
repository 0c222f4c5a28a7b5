#include "views.hpp"

#include "parallel.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <utility>

namespace fathom::bench {
namespace {

View seen(std::string name, const char* scene, oracle::Subject subject, double check, int width, int height) {
    subject.camera.width = width;
    subject.camera.height = height;
    const bool closed = name == "room" || name == "railings" || name == "corridor" || name == "mirror";
    return {std::move(name), scene::named(scene), std::move(subject), check, closed};
}

// The mirror of the demo: the room's right wall is one.
oracle::Subject mirrored(double aspect) {
    constexpr double third_of_pi = 1.0471975511965976;
    oracle::Subject subject = oracle::with_oblique_near_plane(
        oracle::from_field_of_view(third_of_pi, aspect, {0.1, 50}), {0.6, 0, -0.8, -1.95});
    subject.camera.view = Eigen::Matrix4d{{-0.6, 0, 0.8, 3.54}, {0, 1, 0, 0}, {0.8, 0, 0.6, -4.72}, {0, 0, 0, 1}};
    return subject;
}

// The room from above, below its ceiling, its length across the image.
oracle::Subject from_above(double aspect) {
    constexpr double half = 5.6;
    oracle::Subject subject = oracle::from_orthographic({-half, half, -half / aspect, half / aspect}, {0, 4});
    subject.camera.view = Eigen::Matrix4d{{0, 0, -1, -4.5}, {-1, 0, 0, 0}, {0, 1, 0, -1.3}, {0, 0, 0, 1}};
    return subject;
}

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double touching = 1e-7; ///< scene units: solids that are no farther apart have no gap

// Where a ray is inside a surface, from each place where it goes in to the one where it comes out.
std::vector<std::pair<double, double>> passages(const scene::Scene& surface, scene::Ray ray) {
    std::vector<std::pair<double, double>> list;
    bool inside = false;
    while (const auto met = scene::met(surface, ray)) {
        const double at = (met->position - ray.origin).dot(ray.direction);
        if (inside)
            list.back().second = at;
        else
            list.emplace_back(at, infinity);
        inside = !inside;
        ray.first = at + touching;
    }
    return list;
}

} // namespace

View room_view(int width, int height) {
    return seen("room", "room", oracle::from_field_of_view(view_fov_y, 1.0 * width / height, {0.1, 100}), 0.5, width,
                height);
}

std::vector<View> views(int width, int height) {
    const double aspect = 1.0 * width / height;
    const auto perspective = [&](DepthSpan span) { return oracle::from_field_of_view(view_fov_y, aspect, span); };
    const DepthSpan infinite{1, infinity, DepthOrder::reversed};
    std::vector<View> list{room_view(width, height)};
    const auto add = [&](const char* name, const char* scene, oracle::Subject subject, double check) {
        list.push_back(seen(name, scene, std::move(subject), check, width, height));
    };
    add("terrain", "terrain", perspective(infinite), 12);
    add("railings", "railings", perspective({0.1, 100}), 0.5);
    add("spheres", "spheres", perspective({0.1, 1000}), 0.5);
    add("corridor", "corridor", perspective({0.01, 1000}), 0.5);
    add("mirror", "room", mirrored(aspect), 0.5);
    add("plan", "room", from_above(aspect), 0.5);
    return list;
}

std::vector<View> pinhole_views(int width, int height) {
    std::vector<View> list;
    for (View& view : views(width, height)) {
        const oracle::Frustum frustum = *view.subject.frustum;
        if (frustum.is_orthographic || frustum.plane || frustum.reversed)
            continue;
        const DepthSpan span{static_cast<double>(frustum.near), static_cast<double>(frustum.far)};
        const Convention axes{ClipZ::negative_one_to_one, ClipY::up, ViewAxes::opencv};
        view.subject = oracle::named(oracle::from_field_of_view(view_fov_y, 1.0 * width / height, span, axes),
                                     view.name, width, height);
        list.push_back(view);
    }
    return list;
}

std::vector<float> ends_of(const View& view) {
    const scene::Caster caster(view.scene, view.camera());
    const Eigen::Matrix4d to_world = scene::to_world(view.camera());
    const auto width = static_cast<std::size_t>(view.camera().width);
    std::vector<float> ends(width * static_cast<std::size_t>(view.camera().height));
    oracle::in_parallel(ends.size(), [&](std::size_t i) {
        const scene::Ray seen = caster.ray(static_cast<double>(i % width) + 0.5, static_cast<double>(i / width) + 0.5);
        const double unit = seen.direction.norm();
        scene::Ray ray{(to_world * seen.origin.homogeneous()).head<3>(),
                       to_world.topLeftCorner<3, 3>() * seen.direction / unit, seen.first * unit, seen.last * unit};
        const auto met = scene::met(view.scene, ray);
        ends[i] = std::numeric_limits<float>::quiet_NaN();
        if (!met)
            return;
        const double start = (met->position - ray.origin).dot(ray.direction);
        ray.last = infinity;
        std::vector<std::pair<double, double>> solid;
        for (const scene::Primitive& primitive : view.scene)
            if (!std::holds_alternative<scene::Disk>(primitive))
                for (const auto& passage : passages({primitive}, ray))
                    solid.push_back(passage);
        double end = start;
        const auto goes_on = [&](const auto& passage) {
            return passage.first <= end + touching && passage.second > end + touching;
        };
        for (auto next = std::ranges::find_if(solid, goes_on); next != solid.end();
             next = std::ranges::find_if(solid, goes_on))
            end = next->second;
        if (end == start) // a disk
            end = infinity;
        ends[i] = static_cast<float>(std::abs(seen.origin.z() + end * seen.direction.z() / unit));
    });
    return ends;
}

Eigen::Vector3d color_of(const View& view, const Eigen::Vector3d& position, const Eigen::Vector3d& normal) {
    const Eigen::Array3d place = position.array() / view.check;
    const bool odd = static_cast<long>((place + 1e-6).floor().sum()) & 1;
    const double light = 0.55 + 0.45 * normal.dot(Eigen::Vector3d(0.3, 0.8, 0.5).normalized());
    return (light * (odd ? 0.5 : 1) * (0.45 + 0.25 * normal.array())).matrix();
}

Eigen::Vector3d sky_color() {
    return {0.3, 0.45, 0.7};
}

} // namespace fathom::bench
