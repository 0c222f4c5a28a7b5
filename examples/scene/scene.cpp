// One ray per pixel: the line of view-space points whose clip coordinates lie at the pixel, cut to the view volume.
//   E = P⁻¹ (0, 0, 1, 0)                    the camera centre; at infinity (E_w = 0) for an orthographic projection
//   C = P⁻¹ (x_c, y_c, z_c, 1)              a point that the pixel sees, any z_c
//   ray = E + t (C_xyz − C_w E)             perspective; C + t E_xyz otherwise, turned so that it runs from near to far
// Inside the volume w, the distance past the near plane and the one to the far plane are positive, and each is linear
// in t. All three come from P's rows, so oblique planes need nothing of their own.

#include "scene/scene.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <utility>

namespace fathom::scene {
namespace {

using Eigen::Vector3d;
using Matrix4 = Eigen::Matrix<long double, 4, 4>;
using Vector4 = Eigen::Matrix<long double, 4, 1>;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Hit {
    double t;
    Vector3d normal;
};

/// The first of two candidates, in ascending order, that lies within the ray's range.
std::optional<double> first_inside(const Ray& ray, double t0, double t1) {
    if (t0 >= ray.first && t0 <= ray.last) {
        return t0;
    }
    if (t1 >= ray.first && t1 <= ray.last) {
        return t1;
    }
    return std::nullopt;
}

std::optional<Hit> intersect(const Plane& plane, const Ray& ray) {
    const double slope = plane.normal.dot(ray.direction);
    if (slope == 0) {
        return std::nullopt;
    }
    const double t = plane.normal.dot(plane.point - ray.origin) / slope;
    return first_inside(ray, t, t) ? std::optional(Hit{t, plane.normal}) : std::nullopt;
}

std::optional<Hit> intersect(const Disk& disk, const Ray& ray) {
    const auto hit = intersect(Plane{disk.centre, disk.normal}, ray);
    return hit && (ray.at(hit->t) - disk.centre).norm() <= disk.radius ? hit : std::nullopt;
}

std::optional<Hit> intersect(const Sphere& sphere, const Ray& ray) {
    const double a = ray.direction.squaredNorm();
    const double middle = (sphere.centre - ray.origin).dot(ray.direction) / a;
    const double outside = (ray.at(middle) - sphere.centre).squaredNorm();
    const double square = (sphere.radius * sphere.radius - outside) / a;
    if (square < 0) {
        return std::nullopt;
    }
    const double half = std::sqrt(square);
    const auto t = first_inside(ray, middle - half, middle + half);
    return t ? std::optional(Hit{*t, ray.at(*t) - sphere.centre}) : std::nullopt;
}

/// Where a ray is inside a box around the origin, and through which faces it comes and goes.
struct Passage {
    double enter = -infinity, leave = infinity;
    int enter_axis = 0, leave_axis = 0;
};

Passage passage(const Vector3d& half_size, const Vector3d& origin, const Vector3d& direction) {
    Passage result;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0) {
            if (std::abs(origin[axis]) > half_size[axis]) {
                return {infinity, -infinity};
            }
            continue;
        }
        const double a = (-half_size[axis] - origin[axis]) / direction[axis];
        const double b = (half_size[axis] - origin[axis]) / direction[axis];
        if (std::min(a, b) > result.enter) {
            result.enter = std::min(a, b);
            result.enter_axis = axis;
        }
        if (std::max(a, b) < result.leave) {
            result.leave = std::max(a, b);
            result.leave_axis = axis;
        }
    }
    return result;
}

std::optional<Hit> intersect(const Box& box, const Ray& ray) {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    if (box.yaw != 0) {
        turn = Eigen::AngleAxisd(box.yaw, Vector3d::UnitY());
    }
    const auto [enter, leave, enter_axis, leave_axis] =
        passage(box.half_size, turn.transpose() * (ray.origin - box.centre), turn.transpose() * ray.direction);
    const auto t = enter <= leave ? first_inside(ray, enter, leave) : std::nullopt;
    return t ? std::optional(Hit{*t, turn.col(*t == enter ? enter_axis : leave_axis)}) : std::nullopt;
}

double height(const HeightField& field, double x, double z) {
    double y = field.base;
    for (const auto& wave : field.waves) {
        y += wave.amplitude * std::sin(wave.kx * x + wave.kz * z + wave.phase);
    }
    return y;
}

Vector3d upward(const HeightField& field, const Vector3d& p) {
    Vector3d normal = Vector3d::UnitY();
    for (const auto& wave : field.waves) {
        const double slope = wave.amplitude * std::cos(wave.kx * p.x() + wave.kz * p.z() + wave.phase);
        normal -= slope * Vector3d(wave.kx, 0, wave.kz);
    }
    return normal;
}

/// Steps that the steepest possible change of height allows, then bisection down to neighbouring doubles.
std::optional<Hit> intersect(const HeightField& field, const Ray& ray) {
    const Vector3d& d = ray.direction;
    double steepest = std::abs(d.y()), tallest = 0;
    for (const auto& wave : field.waves) {
        steepest += std::abs(wave.amplitude * (wave.kx * d.x() + wave.kz * d.z()));
        tallest += std::abs(wave.amplitude);
    }
    const auto inside =
        passage({field.half_size, tallest, field.half_size}, ray.origin - Vector3d(0, field.base, 0), d);
    const double first = std::max(ray.first, inside.enter), last = std::min(ray.last, inside.leave);
    if (!(first <= last)) {
        return std::nullopt;
    }
    const auto above = [&](double t) {
        const Vector3d p = ray.at(t);
        return p.y() - height(field, p.x(), p.z());
    };
    const double sign = above(first) >= 0 ? 1 : -1;
    const double least = (last - first) * 1e-6;
    double before = first, t = first;
    while (sign * above(t) > 0) {
        if (t >= last) {
            return std::nullopt;
        }
        before = t;
        t = std::min(last, t + std::max(least, std::abs(above(t)) / steepest));
    }
    while (std::midpoint(before, t) != before && std::midpoint(before, t) != t) {
        const double middle = std::midpoint(before, t);
        (sign * above(middle) > 0 ? before : t) = middle;
    }
    return Hit{t, upward(field, ray.at(t))};
}

/// Nearer end of a chord first; either may lie above the rim.
std::optional<Hit> intersect(const Bowl& bowl, const Ray& ray) {
    const double a = ray.direction.squaredNorm();
    const double middle = (bowl.centre - ray.origin).dot(ray.direction) / a;
    const double square = (bowl.radius * bowl.radius - (ray.at(middle) - bowl.centre).squaredNorm()) / a;
    if (square < 0) {
        return std::nullopt;
    }
    for (const double t : {middle - std::sqrt(square), middle + std::sqrt(square)}) {
        const Vector3d outward = ray.at(t) - bowl.centre;
        if (t >= ray.first && t <= ray.last && outward.dot(bowl.axis) <= bowl.depth - bowl.radius) {
            return Hit{t, outward};
        }
    }
    return std::nullopt;
}

std::optional<Hit> intersect(const Primitive& primitive, const Ray& ray) {
    return std::visit([&](const auto& shape) { return intersect(shape, ray); }, primitive);
}

/// Takes a camera apart once, for all its pixels.
class CameraView {
public:
    explicit CameraView(const Camera& camera)
        : camera_(camera), p_(camera.projection.matrix), inverse_(p_.inverse()), to_world_(to_world(camera)) {
        const bool symmetric = camera.projection.convention.clip_z == ClipZ::negative_one_to_one;
        const bool reversed = camera.projection.order == DepthOrder::reversed;
        low_ = symmetric ? -1 : 0;
        near_ = reversed ? 1 : low_;
        far_ = reversed ? low_ : 1;
        centre_ = inverse_ * Vector4(0, 0, 1, 0);
        // An affine projection has an exact zero here but for the rounding of the inverse.
        perspective_ = std::abs(centre_.w()) * p_.norm() > 1e-15L * centre_.norm();
        if (perspective_) {
            centre_ /= centre_.w();
        }

        ahead_ = camera.projection.convention.view_axes == ViewAxes::opengl ? -1 : 1;
    }

    /// The pixel's ray in view space.
    Ray ray(double x, double y) const {
        const long double row = camera_.rows == Rows::top_down ? y : camera_.height - y;
        const long double up = camera_.projection.convention.clip_y == ClipY::up ? 1 : -1;
        const Vector4 seen = inverse_ * Vector4(2 * static_cast<long double>(x) / camera_.width - 1,
                                                up * (1 - 2 * row / camera_.height), (near_ + far_) / 2, 1);
        Vector4 origin = centre_;
        Vector4 direction = seen - seen.w() * centre_;
        if (!perspective_) {
            origin = seen / seen.w();
            direction = centre_;
        }
        direction.w() = 0;
        const Vector4 start = p_ * origin;
        Vector4 slope = p_ * direction;
        const long double along = perspective_ ? slope.w() : (far_ - near_) * (slope.z() / start.w());
        if (along < 0) {
            direction = -direction;
            slope = -slope;
        }
        Ray ray{origin.head<3>().cast<double>(), direction.head<3>().cast<double>(), -infinity, infinity};
        const long double sense = far_ > near_ ? 1 : -1;
        keep_positive(ray, start.w(), slope.w());
        keep_positive(ray, sense * (start.z() - near_ * start.w()), sense * (slope.z() - near_ * slope.w()));
        keep_positive(ray, sense * (far_ * start.w() - start.z()), sense * (far_ * slope.w() - slope.z()));
        return ray;
    }

    Ray in_world(const Ray& ray) const {
        return {(to_world_ * ray.origin.homogeneous()).head<3>(), to_world_.topLeftCorner<3, 3>() * ray.direction,
                ray.first, ray.last};
    }

    Surface surface(const Ray& ray, const Hit& hit) const {
        const Vector3d position = ray.at(hit.t);
        Vector3d normal = (to_world_.topLeftCorner<3, 3>().transpose() * hit.normal).normalized();
        if (normal.dot(ray.direction) > 0) {
            normal = -normal;
        }
        return {position, normal, ahead_ * position.z(), static_cast<double>(stored(position, ray.direction))};
    }

    double clear() const {
        if (camera_.background) {
            return *camera_.background;
        }
        switch (camera_.encoding) {
        case Encoding::window:
            return static_cast<double>(in_range((far_ - low_) / (1 - low_)));
        case Encoding::view_z:
        case Encoding::ray_distance:
            return infinity;
        case Encoding::inverse:
            return 0;
        default:
            return 1;
        }
    }

private:
    /// Cuts the ray to where start + t · slope ≥ 0.
    static void keep_positive(Ray& ray, long double start, long double slope) {
        const double t = static_cast<double>(-start / slope);
        if (slope > 0) {
            ray.first = std::max(ray.first, t);
        } else if (slope < 0) {
            ray.last = std::min(ray.last, t);
        } else if (start < 0) {
            ray.last = -infinity;
        }
    }

    long double in_range(long double share) const {
        const auto [low, high] = camera_.depth_range;
        return low + share * (static_cast<long double>(high) - low);
    }

    /// The stored value of a view-space point, by the definition of each encoding.
    long double stored(const Vector3d& position, const Vector3d& direction) const {
        const Camera& c = camera_;
        const long double z = ahead_ * position.z();
        switch (c.encoding) {
        case Encoding::window: {
            const Vector4 clip = p_ * position.cast<long double>().homogeneous();
            return in_range(std::clamp((clip.z() / clip.w() - low_) / (1 - low_), 0.0L, 1.0L));
        }
        case Encoding::view_z:
            return z / c.scale;
        case Encoding::ray_distance: {
            const Vector3d from_centre = position - centre_.head<3>().cast<double>();
            const double cosine = ahead_ * direction.z() / direction.norm();
            return (perspective_ ? static_cast<long double>(from_centre.norm()) : z / cosine) / c.scale;
        }
        case Encoding::linear:
        case Encoding::pseudo_linear:
            return (z - c.near_plane.value()) / (c.far_plane.value() - c.near_plane.value());
        case Encoding::logarithmic:
            return std::log1p(c.log_c * z) / std::log1p(c.log_c * static_cast<long double>(c.far_plane.value()));
        case Encoding::exponential:
            return std::log(z / c.near_plane.value()) /
                   std::log(c.far_plane.value() / static_cast<long double>(c.near_plane.value()));
        case Encoding::median:
            return in_range(((z - c.median.value()) / (z + c.median.value()) + 1) / 2);
        case Encoding::inverse:
            return c.scale / z - c.offset;
        case Encoding::inverse_range: {
            const long double near = c.near_plane.value(), far = c.far_plane.value();
            return (1 / near - 1 / z) / (1 / near - 1 / far);
        }
        }
        throw std::invalid_argument("encoding: no such value");
    }

    const Camera& camera_;
    Matrix4 p_, inverse_;
    long double low_, near_, far_;
    Vector4 centre_;
    bool perspective_;
    double ahead_;
    Eigen::Matrix4d to_world_;
};

std::optional<Hit> first_hit(const Scene& scene, const Ray& world) {
    std::optional<Hit> nearest;
    for (const auto& primitive : scene) {
        const auto hit = intersect(primitive, world);
        if (hit && (!nearest || hit->t < nearest->t)) {
            nearest = hit;
        }
    }
    return nearest;
}

std::optional<Surface> cast(const Scene& scene, const CameraView& view, double x, double y) {
    const Ray ray = view.ray(x, y);
    const auto nearest = first_hit(scene, view.in_world(ray));
    return nearest ? std::optional(view.surface(ray, *nearest)) : std::nullopt;
}

bool metric(Encoding encoding) {
    return encoding == Encoding::view_z || encoding == Encoding::ray_distance || encoding == Encoding::inverse;
}

template <typename Code>
std::vector<Code> codes(const Rendered& image, const Camera& camera, double highest) {
    const double factor = metric(camera.encoding) ? 1 : highest;
    std::vector<Code> result(image.exact.size());
    std::ranges::transform(image.exact, result.begin(), [&](double value) {
        return static_cast<Code>(std::clamp(std::round(value * factor), 0.0, highest));
    });
    return result;
}

} // namespace

std::optional<Surface> cast(const Scene& scene, const Camera& camera, double x, double y) {
    return cast(scene, CameraView(camera), x, y);
}

struct Caster::Parts {
    Parts(Scene&& whole_scene, Camera&& whole_camera)
        : scene(std::move(whole_scene)), camera(std::move(whole_camera)), view(camera) {}

    Scene scene;
    Camera camera;
    CameraView view; // refers to `camera`
};

Caster::Caster(Scene scene, Camera camera)
    : parts_(std::make_shared<const Parts>(std::move(scene), std::move(camera))) {}

const Scene& Caster::scene() const {
    return parts_->scene;
}

const Camera& Caster::camera() const {
    return parts_->camera;
}

Ray Caster::ray(double x, double y) const {
    return parts_->view.ray(x, y);
}

std::optional<Surface> Caster::at(double x, double y) const {
    return cast(parts_->scene, parts_->view, x, y);
}

bool blocked(const Scene& scene, const Vector3d& origin, const Vector3d& direction, double length, double least) {
    const Ray ray{origin, direction, least, length};
    return std::ranges::any_of(scene, [&](const auto& primitive) { return intersect(primitive, ray).has_value(); });
}

std::optional<Met> met(const Scene& scene, const Ray& ray) {
    const auto hit = first_hit(scene, ray);
    if (!hit) {
        return std::nullopt;
    }
    const Vector3d normal = hit->normal.normalized();
    return Met{ray.at(hit->t), normal.dot(ray.direction) > 0 ? Vector3d(-normal) : normal};
}

std::array<Eigen::Matrix3d, 6> cube_turns() {
    const auto turned = [](const Vector3d& axis, int degrees) {
        return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis).toRotationMatrix();
    };
    const Vector3d up = Vector3d::UnitY(), right = Vector3d::UnitX();
    return {turned(up, 0), turned(up, 90), turned(up, 180), turned(up, 270), turned(right, 90), turned(right, 270)};
}

Eigen::Matrix4d to_world(const Camera& camera) {
    if (camera.view) {
        return camera.view->inverse();
    }
    using enum ViewAxes;
    const ViewAxes axes = camera.projection.convention.view_axes;
    return Eigen::Vector4d(1, axes == opencv ? -1 : 1, axes == opengl ? 1 : -1, 1).asDiagonal();
}

double clear_value(const Camera& camera) {
    return CameraView(camera).clear();
}

namespace {

/// An image of which no pixel sees anything; `see` is given those of each row in turn, from several threads.
template <typename See>
Rendered rendered(const Camera& camera, double clear, const See& see) {
    const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    Rendered image{.width = camera.width,
                   .height = camera.height,
                   .stored = {},
                   .exact = std::vector(pixels, clear),
                   .z = std::vector(pixels, infinity),
                   .position = std::vector<Vector3d>(pixels, Vector3d::Constant(nan)),
                   .normal = std::vector<Vector3d>(pixels, Vector3d::Zero())};
    std::atomic<int> next_row = 0;
    const auto work = [&] {
        for (int y = next_row++; y < camera.height; y = next_row++) {
            for (int x = 0; x < camera.width; ++x) {
                see(image, x, y,
                    static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x));
            }
        }
    };
    {
        std::vector<std::jthread> others;
        for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) {
            others.emplace_back(work);
        }
        work();
    }
    image.stored.assign(image.exact.begin(), image.exact.end());
    return image;
}

} // namespace

Rendered render(const Scene& scene, const Camera& camera) {
    const CameraView view(camera);
    return rendered(camera, view.clear(), [&](Rendered& image, int x, int y, std::size_t i) {
        if (const auto surface = cast(scene, view, x + 0.5, y + 0.5)) {
            image.exact[i] = surface->stored;
            image.z[i] = surface->z;
            image.position[i] = surface->position;
            image.normal[i] = surface->normal;
        }
    });
}

Rendered render(const Scene& scene, const Camera& camera, const RayOf& ray_of) {
    const Eigen::Matrix4d world = to_world(camera);
    const Eigen::Matrix3d turn = world.topLeftCorner<3, 3>();
    const Vector3d centre = world.topRightCorner<3, 1>();
    const double forwards = camera.projection.convention.view_axes == ViewAxes::opengl ? -1 : 1;
    return rendered(camera, infinity, [&](Rendered& image, int x, int y, std::size_t i) {
        const std::optional<Vector3d> ray = ray_of(x + 0.5, y + 0.5);
        if (!ray) {
            image.exact[i] = nan;
            return;
        }
        if (const auto found = met(scene, {centre, turn * *ray, 0, infinity})) {
            const double distance = (found->position - centre).norm();
            image.position[i] = distance * *ray;
            image.z[i] = forwards * image.position[i].z();
            image.normal[i] = turn.transpose() * found->normal;
            image.exact[i] = (camera.encoding == Encoding::ray_distance ? distance
                              : image.z[i] > 0                          ? image.z[i]
                                                                        : nan) /
                             camera.scale;
        }
    });
}

std::vector<std::uint16_t> codes16(const Rendered& image, const Camera& camera) {
    return codes<std::uint16_t>(image, camera, 0xFFFF);
}

std::vector<std::uint32_t> codes24(const Rendered& image, const Camera& camera) {
    return codes<std::uint32_t>(image, camera, 0xFFFFFF);
}

std::vector<float> read_back(const Rendered& image, DepthBits bits) {
    if (bits == DepthBits::d32f) {
        return image.stored;
    }
    const double highest = bits == DepthBits::d16 ? 0xFFFF : 0xFFFFFF;
    std::vector<float> result(image.exact.size());
    std::ranges::transform(image.exact, result.begin(), [&](double value) {
        return static_cast<float>(std::round(std::clamp(value, 0.0, 1.0) * highest) / highest);
    });
    return result;
}

} // namespace fathom::scene
