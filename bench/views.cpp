#include "views.hpp"

#include <Eigen/Geometry>

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
