#include "occlusion.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace oracle {

using Eigen::Vector2d;
using Eigen::Vector3d;
using fathom::Camera;
using fathom::scene::Caster;
using fathom::scene::Scene;
using Sight = DepthLayer::Sight;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

double visibility(const Scene& scene, const Vector3d& position, const Vector3d& normal, double radius, int azimuths,
                  int samples) {
    const Vector3d across = normal.unitOrthogonal(), along = normal.cross(across);
    const double width = std::numbers::pi / 2 / samples;
    double sum = 0;
    for (int i = 0; i < azimuths; ++i) {
        const double azimuth = 2 * std::numbers::pi * (i + 0.5) / azimuths;
        const Vector3d outward = std::cos(azimuth) * across + std::sin(azimuth) * along;
        const auto open = [&](double polar) {
            return !blocked(scene, position, std::cos(polar) * normal + std::sin(polar) * outward, radius);
        };
        const auto share = [](double polar) { return std::sin(polar) * std::sin(polar); };
        double start = 0, polar = 0.5 * width;
        bool was_open = open(polar);
        for (int k = 1; k < samples; ++k) {
            const double next = (k + 0.5) * width;
            if (open(next) != was_open) {
                double before = polar, after = next;
                while (after - before > 1e-9) {
                    const double middle = 0.5 * (before + after);
                    (open(middle) == was_open ? before : after) = middle;
                }
                sum += was_open ? share(after) - start : 0;
                start = share(after);
                was_open = !was_open;
            }
            polar = next;
        }
        sum += was_open ? 1 - start : 0;
    }
    return sum / azimuths;
}

namespace {

/// In a slice, seen from the point: first along the side's tangent, then towards the eye.
struct Column {
    Vector2d front, direction; ///< direction of unit length, away from the eye
    double depth, depth_rate;  ///< view depth of the front and its growth along the column
};

/// Angles from the view direction, as cosines: from `low` to `high`.
struct Range {
    double low, high;
};

double cosine(const Vector2d& place) {
    return place.y() / place.norm();
}

/// What one side of a slice has blocked so far.
class Side {
public:
    /// `normal` in the slice, likewise first along the tangent; `scratch` is emptied.
    Side(const Vector2d& normal, const ScreenOptions& options, std::vector<Range>& scratch)
        : normal_(normal), options_(options), done_(scratch) {
        done_.clear();
        const double horizon = -normal.x() / normal.norm();
        whole_ = normal.y() >= 0 ? Range{horizon, 1} : Range{-1, -horizon};
        if (!(normal.norm() > 0)) {
            whole_ = {0, 0};
        }
    }

    void add(const Column& column) {
        block(column.front, column.direction, options_.thickness);
        if (before_) {
            const double reach = options_.thickness * column.depth_rate;
            const double reach_before = options_.thickness * before_->depth_rate;
            const bool connected = std::isinf(options_.thickness) || (column.depth <= before_->depth + reach_before &&
                                                                      before_->depth <= column.depth + reach);
            const Vector2d link = column.front - before_->front;
            if (connected && link.squaredNorm() > 0) {
                block(before_->front, link.normalized(), link.norm());
            }
        }
        before_ = column;
    }

    /// A tap that sees nothing connects to nothing.
    void skip() { before_.reset(); }

    double whole() const { return measure(whole_); }

    double blocked() {
        done_.push_back(current_);
        std::ranges::sort(done_, {}, &Range::low);
        double sum = 0, end = -1;
        for (const auto& [low, high] : done_) {
            if (high > end) {
                sum += measure({std::max(low, end), high});
                end = high;
            }
        }
        return sum;
    }

private:
    /// Blocks what a straight piece of solid spans within the ball.
    void block(const Vector2d& start, const Vector2d& direction, double length) {
        const double middle = start.dot(direction);
        const double square = middle * middle - start.squaredNorm() + options_.radius * options_.radius;
        if (square < 0) {
            return;
        }
        const double first = std::max(0.0, -middle - std::sqrt(square));
        const double last = std::min(length, -middle + std::sqrt(square));
        if (first > last) {
            return;
        }
        const double a = cosine(start + first * direction);
        const double b = std::isinf(last) ? direction.y() : cosine(start + last * direction);
        const Range range{std::max(std::min(a, b), whole_.low), std::min(std::max(a, b), whole_.high)};
        if (range.low > range.high) {
            return;
        }
        if (range.low <= current_.high && range.high >= current_.low) {
            current_ = {std::min(current_.low, range.low), std::max(current_.high, range.high)};
            return;
        }
        if (current_.high > current_.low) {
            done_.push_back(current_);
        }
        current_ = range;
    }

    double measure(const Range& range) const { return antiderivative(range.low) - antiderivative(range.high); }

    double antiderivative(double cosine) const {
        const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
        const double t = std::atan2(sine, cosine);
        return 0.5 * (normal_.y() * sine * sine + normal_.x() * (t - sine * cosine));
    }

    Vector2d normal_;
    const ScreenOptions& options_;
    std::vector<Range>& done_;
    Range whole_{}, current_{-2, -2};
    std::optional<Column> before_;
};

/// The line of a slice on the screen: taps at `start` + k · `step`, k = 1, 2, ...; their rays in the slice are affine in k.
struct Line {
    Vector2d start, step;
    Vector2d origin, origin_step, direction, direction_step;

    Vector2d origin_at(int k) const { return origin + k * origin_step; }
    Vector2d direction_at(int k) const { return direction + k * direction_step; }
};

/// `step_of` turns a unit vector on the screen into the step from tap to tap.
template <typename StepOf>
Line line_of(const Sight& sight, const Vector2d& pixel, const Vector3d& position, const Vector3d& tangent,
             const Vector3d& to_eye, const StepOf& step_of) {
    const Vector3d across = tangent.cross(to_eye);
    const Vector3d& by_x = sight.parallel ? sight.origin_x : sight.direction_x;
    const Vector3d& by_y = sight.parallel ? sight.origin_y : sight.direction_y;
    Vector2d along = Vector2d(-across.dot(by_y), across.dot(by_x)).normalized();
    if ((along.x() * by_x + along.y() * by_y).dot(tangent) < 0) {
        along = -along;
    }
    const Vector2d step = step_of(along);
    const auto in_slice = [&](const Vector3d& v) { return Vector2d(v.dot(tangent), v.dot(to_eye)); };
    return {pixel,
            step,
            in_slice(sight.origin_at(pixel.x(), pixel.y()) - position),
            in_slice(step.x() * sight.origin_x + step.y() * sight.origin_y),
            in_slice(sight.direction_at(pixel.x(), pixel.y())),
            in_slice(step.x() * sight.direction_x + step.y() * sight.direction_y)};
}

/// Does a ray come within the radius of the point? From the eye on, or anywhere if rays are parallel.
bool within_reach(const Line& line, int k, bool parallel, double radius) {
    const Vector2d origin = line.origin_at(k), direction = line.direction_at(k);
    const double nearest = -origin.dot(direction) / direction.squaredNorm();
    return (origin + (parallel ? nearest : std::max(0.0, nearest)) * direction).norm() <= radius;
}

/// Sums all slices. `column_at(line, k, place, tangent)` is the column that a tap at a place on the screen sees, if any.
template <typename StepOf, typename ColumnAt>
double visibility_of(const Sight& sight, const Vector2d& pixel, const Vector3d& position, const Vector3d& normal,
                     const Vector2d& size, const ScreenOptions& options, const StepOf& step_of,
                     const ColumnAt& column_at) {
    const Vector3d to_eye = -sight.direction_at(pixel.x(), pixel.y()).normalized();
    const Vector3d right = to_eye.unitOrthogonal(), up = to_eye.cross(right);
    std::vector<Range> scratch;
    double blocked = 0, whole = 0;
    for (int i = 0; i < 2 * options.slices; ++i) {
        const double azimuth = std::numbers::pi * (i + 0.5) / options.slices;
        const Vector3d tangent = std::cos(azimuth) * right + std::sin(azimuth) * up;
        const Line line = line_of(sight, pixel, position, tangent, to_eye, step_of);
        Side side({normal.dot(tangent), normal.dot(to_eye)}, options, scratch);
        for (int k = 1; within_reach(line, k, sight.parallel, options.radius); ++k) {
            const Vector2d place = line.start + k * line.step;
            if (!(place.x() >= 0 && place.x() <= size.x() && place.y() >= 0 && place.y() <= size.y())) {
                break;
            }
            if (const std::optional<Column> column = column_at(line, k, place, tangent)) {
                side.add(*column);
            } else {
                side.skip();
            }
        }
        blocked += side.blocked();
        whole += side.whole();
    }
    return 1 - blocked / whole;
}

} // namespace

Sight::Sight(const Camera& camera) {
    const Caster caster({}, camera);
    const auto corner = caster.ray(0, 0), right = caster.ray(camera.width, 0), below = caster.ray(0, camera.height);
    origin = corner.origin;
    origin_x = (right.origin - corner.origin) / camera.width;
    origin_y = (below.origin - corner.origin) / camera.height;
    direction = corner.direction;
    direction_x = (right.direction - corner.direction) / camera.width;
    direction_y = (below.direction - corner.direction) / camera.height;
    parallel = !origin_x.isZero(0) || !origin_y.isZero(0);
    if (parallel) {
        direction_x.setZero();
        direction_y.setZero();
    }
    ahead = camera.projection.convention.view_axes == fathom::ViewAxes::opengl ? -1 : 1;
}

double screen_visibility(const Caster& caster, int x, int y, const ScreenOptions& options,
                         const std::optional<Vector3d>& normal) {
    const Vector2d pixel(x + 0.5, y + 0.5);
    const auto centre = caster.at(pixel.x(), pixel.y());
    if (!centre) {
        return 1;
    }
    const Sight sight(caster.camera());
    const Vector3d to_eye = -sight.direction_at(pixel.x(), pixel.y()).normalized();
    const auto column_at = [&](const Line& line, int k, const Vector2d& place,
                               const Vector3d& tangent) -> std::optional<Column> {
        const auto seen = caster.at(place.x(), place.y());
        if (!seen) {
            return std::nullopt;
        }
        const Vector3d away = seen->position - centre->position;
        const double rate = sight.ahead * sight.direction_at(place.x(), place.y()).normalized().z();
        return Column{{away.dot(tangent), away.dot(to_eye)}, line.direction_at(k).normalized(), seen->z, rate};
    };
    return visibility_of(
        sight, pixel, centre->position, normal.value_or(centre->normal),
        Vector2d(caster.camera().width, caster.camera().height), options,
        [&](const Vector2d& along) -> Vector2d { return options.step_px * along; }, column_at);
}

double screen_visibility(const Scene& scene, const Camera& camera, int x, int y, const ScreenOptions& options,
                         const std::optional<Vector3d>& normal) {
    return screen_visibility(Caster(scene, camera), x, y, options, normal);
}

DepthLayer::DepthLayer(const Camera& camera, std::span<const double> z)
    : width_(camera.width), height_(camera.height), sight_(camera), planar_(z.size(), nan) {
    for (int y = 0; y < height_; ++y) {
        for (int x = 0; x < width_; ++x) {
            const double depth = z[index(x, y)], start = sight_.ahead * sight_.origin_at(x + 0.5, y + 0.5).z();
            const double w = (depth - start) / (sight_.ahead * sight_.direction_at(x + 0.5, y + 0.5).z());
            if (std::isfinite(depth)) {
                planar_[index(x, y)] = sight_.parallel ? w : 1 / w;
            } else if (std::isinf(depth)) {
                planar_[index(x, y)] = endless;
            }
        }
    }
    const double length = sight_.direction_at(0.5 * width_, 0.5 * height_).norm();
    share_across_ = (sight_.parallel ? sight_.origin_x : sight_.direction_x).norm() / length;
    share_down_ = (sight_.parallel ? sight_.origin_y : sight_.direction_y).norm() / length;
}

DepthLayer::DepthLayer(const Camera& camera, std::span<const float> z)
    : DepthLayer(camera, std::vector<double>(z.begin(), z.end())) {}

double DepthLayer::between_rows(int across, double along) const {
    return between(index(across, 0), static_cast<std::size_t>(width_), height_, along, share_down_);
}

double DepthLayer::between_columns(int across, double along) const {
    return between(index(0, across), 1, width_, along, share_across_);
}

double DepthLayer::between(std::size_t start, std::size_t stride, int count, double along,
                           double share_per_pixel) const {
    const auto at = [&](int i) { return planar_[start + stride * static_cast<std::size_t>(i)]; };
    const int nearest = std::clamp(static_cast<int>(std::floor(along)), 0, count - 1);
    if (count == 1) {
        return at(nearest);
    }
    const int first = std::clamp(static_cast<int>(std::floor(along - 0.5)), 0, count - 2);
    const double a = at(first), b = at(first + 1);
    const double slope = b - a;
    if (!std::isfinite(slope)) {
        return at(nearest);
    }
    const double allowed = std::max(0.5 * std::abs(slope), share_per_pixel * (sight_.parallel ? 1 : std::min(a, b)));
    const bool smooth = (first > 0 && std::abs(slope - (a - at(first - 1))) <= allowed) ||
                        (first + 2 < count && std::abs(at(first + 2) - b - slope) <= allowed);
    return smooth ? a + (along - 0.5 - first) * slope : at(nearest);
}

double screen_visibility(const DepthLayer& layer, int x, int y, const Vector3d& normal, const ScreenOptions& options) {
    const double own = layer.planar(x, y);
    if (!std::isfinite(own)) {
        return std::isnan(own) ? nan : 1;
    }
    const Sight& sight = layer.sight();
    const Vector2d pixel(x + 0.5, y + 0.5);
    const auto from_planar = [&](double planar) { return sight.parallel ? planar : 1 / planar; };
    const Vector3d position =
        sight.origin_at(pixel.x(), pixel.y()) + from_planar(own) * sight.direction_at(pixel.x(), pixel.y());
    const auto column_at = [&](const Line& line, int k, const Vector2d& place,
                               const Vector3d&) -> std::optional<Column> {
        const bool by_column = std::abs(line.step.x()) >= std::abs(line.step.y());
        const int across = by_column ? x + (line.step.x() > 0 ? k : -k) : y + (line.step.y() > 0 ? k : -k);
        const double planar =
            by_column ? layer.between_rows(across, place.y()) : layer.between_columns(across, place.x());
        if (!std::isfinite(planar)) {
            return std::nullopt;
        }
        const double w = from_planar(planar);
        const Vector2d direction = line.direction_at(k);
        Column column{line.origin_at(k) + w * direction, direction.normalized(), 0, 0};
        if (std::isfinite(options.thickness)) {
            const Vector3d ray = sight.direction_at(place.x(), place.y());
            column.depth = sight.ahead * (sight.origin_at(place.x(), place.y()) + w * ray).z();
            column.depth_rate = sight.ahead * ray.normalized().z();
        }
        return column;
    };
    return visibility_of(
        sight, pixel, position, normal, Vector2d(layer.width(), layer.height()), options,
        [](const Vector2d& along) -> Vector2d { return along / along.cwiseAbs().maxCoeff(); }, column_at);
}

} // namespace oracle
