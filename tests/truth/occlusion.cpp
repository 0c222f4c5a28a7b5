// Slices, taps and columns as occlusion.hpp defines them. All ranges of angles are kept as cosines: no arc is taken before
// the union of what is blocked is known.

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

namespace {

/// Open share of sin² of the polar angle on one azimuth. `open` answers for a polar angle.
template <typename Open>
double open_share(const Open& open, int samples) {
    const auto share = [](double polar) { return std::sin(polar) * std::sin(polar); };
    const double width = std::numbers::pi / 2 / samples;
    double sum = 0, start = 0, polar = 1e-9;
    bool was_open = open(polar);
    for (int k = 1; k <= samples; ++k) {
        const double next = k < samples ? k * width : std::numbers::pi / 2 - 1e-9;
        if (open(next) != was_open) {
            double before = polar, after = next;
            while (after - before > 1e-10) {
                const double middle = 0.5 * (before + after);
                (open(middle) == was_open ? before : after) = middle;
            }
            sum += was_open ? share(after) - start : 0;
            start = share(after);
            was_open = !was_open;
        }
        polar = next;
    }
    return sum + (was_open ? 1 - start : 0);
}

/// What decides whether a function is straight.
double judged(double value) {
    return value;
}
double judged(const Vector2d& value) {
    return value.x();
}

/// Integral from a to b of a function that may jump: trapezes where three values lie on a line, halves otherwise.
template <typename Value, typename Function>
Value integral(const Function& f, double a, const Value& at_a, double b, const Value& at_b, int halvings) {
    const double middle = 0.5 * (a + b);
    const Value at_middle = f(middle);
    if (halvings == 0 || std::abs(judged(at_middle) - 0.5 * (judged(at_a) + judged(at_b))) < 2e-3)
        return 0.25 * (b - a) * (at_a + 2 * at_middle + at_b);
    return integral<Value>(f, a, at_a, middle, at_middle, halvings - 1) +
           integral<Value>(f, middle, at_middle, b, at_b, halvings - 1);
}

/// Integral over a turn, of values at `count` azimuths and of more where the function jumps.
template <typename Function>
auto turn(const Function& f, int count, int halvings) {
    using Value = decltype(f(0.0));
    const double width = 4 * std::numbers::pi / count;
    Value value = f(0.0);
    Value sum = 0 * value;
    for (int i = 0; i < count / 2; ++i) {
        const Value next = f((i + 1) * width);
        sum += integral<Value>(f, i * width, value, (i + 1) * width, next, halvings);
        value = next;
    }
    return sum;
}

/// In a slice, seen from the point: first along the side's tangent, then towards the camera.
struct Column {
    Vector2d front, direction; ///< direction of unit length, away from the camera
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
        if (!(normal.norm() > 0))
            whole_ = {0, 0};
    }

    void add(const Column& column) {
        block(column.front, column.direction, options_.thickness);
        if (before_) {
            const double reach = options_.thickness * column.depth_rate;
            const double reach_before = options_.thickness * before_->depth_rate;
            const bool connected = std::isinf(options_.thickness) || (column.depth <= before_->depth + reach_before &&
                                                                      before_->depth <= column.depth + reach);
            if (connected)
                link(before_->front, column.front);
            if (connected && std::isfinite(options_.thickness))
                link(before_->front + options_.thickness * before_->direction,
                     column.front + options_.thickness * column.direction);
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
        for (const auto& [low, high] : done_)
            if (high > end) {
                sum += measure({std::max(low, end), high});
                end = high;
            }
        return sum;
    }

private:
    void link(const Vector2d& from, const Vector2d& to) {
        const Vector2d way = to - from;
        if (way.squaredNorm() > 0)
            block(from, way.normalized(), way.norm());
    }

    /// Blocks what a straight piece of solid spans within the sphere.
    void block(const Vector2d& start, const Vector2d& direction, double length) {
        const double middle = start.dot(direction);
        const double square = middle * middle - start.squaredNorm() + options_.radius * options_.radius;
        if (square < 0)
            return;
        const double first = std::max(0.0, -middle - std::sqrt(square));
        const double last = std::min(length, -middle + std::sqrt(square));
        if (first > last)
            return;
        const double a = cosine(start + first * direction);
        const double b = std::isinf(last) ? direction.y() : cosine(start + last * direction);
        const Range range{std::max(std::min(a, b), whole_.low), std::min(std::max(a, b), whole_.high)};
        if (range.low > range.high)
            return;
        if (range.low <= current_.high && range.high >= current_.low) {
            current_ = {std::min(current_.low, range.low), std::max(current_.high, range.high)};
            return;
        }
        if (current_.high > current_.low)
            done_.push_back(current_);
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

/// The line of a slice on the screen: taps at `start` + k · `step`, k > 0; their rays in the slice are affine in k.
struct Line {
    Vector2d start, step;
    Vector2d origin, origin_step, direction, direction_step;

    Vector2d place_at(double k) const { return start + k * step; }
    Vector2d origin_at(double k) const { return origin + k * origin_step; }
    Vector2d direction_at(double k) const { return direction + k * direction_step; }
};

/// `step_of` turns a unit vector on the screen into the step from tap to tap.
template <typename StepOf>
Line line_of(const Sight& sight, const Vector2d& pixel, const Vector3d& position, const Vector3d& tangent,
             const Vector3d& to_camera, const StepOf& step_of) {
    const Vector3d across = tangent.cross(to_camera);
    const Vector3d& by_x = sight.is_orthographic ? sight.origin_x : sight.direction_x;
    const Vector3d& by_y = sight.is_orthographic ? sight.origin_y : sight.direction_y;
    Vector2d along = Vector2d(-across.dot(by_y), across.dot(by_x)).normalized();
    if ((along.x() * by_x + along.y() * by_y).dot(tangent) < 0)
        along = -along;
    const Vector2d step = step_of(along);
    const auto in_slice = [&](const Vector3d& v) { return Vector2d(v.dot(tangent), v.dot(to_camera)); };
    return {pixel,
            step,
            in_slice(sight.origin_at(pixel.x(), pixel.y()) - position),
            in_slice(step.x() * sight.origin_x + step.y() * sight.origin_y),
            in_slice(sight.direction_at(pixel.x(), pixel.y())),
            in_slice(step.x() * sight.direction_x + step.y() * sight.direction_y)};
}

/// Does a ray come within the radius of the point? From the camera centre on, or anywhere for an orthographic camera.
bool within_reach(const Line& line, double k, bool is_orthographic, double radius) {
    const Vector2d origin = line.origin_at(k), direction = line.direction_at(k);
    const double nearest = -origin.dot(direction) / direction.squaredNorm();
    return (origin + (is_orthographic ? nearest : std::max(0.0, nearest)) * direction).norm() <= radius;
}

/// What a line of taps needs to know of its slice.
struct Slice {
    Line line;
    Vector2d normal; ///< first along the tangent
};

/// The point whose visibility is asked, on its camera.
struct Centre {
    Vector2d pixel, size; ///< of the point, of the image
    Vector3d position, normal;
};

/// Sums all sides of all slices. `see(slice, k)` is what a tap sees: a column, or nothing.
template <typename StepOf, typename See>
double visibility_of(const Sight& sight, const Centre& centre, const ScreenOptions& options, const StepOf& step_of,
                     const See& see) {
    const Vector2d &pixel = centre.pixel, &size = centre.size;
    const Vector3d &position = centre.position, &normal = centre.normal;
    const Vector3d to_camera = -sight.direction_at(pixel.x(), pixel.y()).normalized();
    const Vector3d right = to_camera.unitOrthogonal(), up = to_camera.cross(right);
    std::vector<Range> scratch;
    const auto blocked_and_whole = [&](double azimuth) -> Vector2d {
        const Vector3d tangent = std::cos(azimuth) * right + std::sin(azimuth) * up;
        const Slice slice{line_of(sight, pixel, position, tangent, to_camera, step_of),
                          {normal.dot(tangent), normal.dot(to_camera)}};
        Side side(slice.normal, options, scratch);
        // The first tap out of reach still ends the line from the last one within.
        bool reached = true;
        for (int k = 1; reached; ++k) {
            const Vector2d place = slice.line.place_at(k);
            if (!(place.x() >= 0 && place.x() <= size.x() && place.y() >= 0 && place.y() <= size.y()))
                break;
            reached = within_reach(slice.line, k, sight.is_orthographic, options.radius);
            if (const std::optional<Column> column = see(slice, k))
                side.add(*column);
            else
                side.skip();
        }
        return {side.blocked(), side.whole()};
    };
    const Vector2d sums = turn(blocked_and_whole, 2 * options.slices, 0);
    return 1 - sums.x() / sums.y();
}

} // namespace

double visibility(const Scene& scene, const Vector3d& position, const Vector3d& normal, double radius, int azimuths,
                  int samples) {
    const Vector3d across = normal.unitOrthogonal(), along = normal.cross(across);
    const auto at = [&](double azimuth) {
        const Vector3d outward = std::cos(azimuth) * across + std::sin(azimuth) * along;
        return open_share(
            [&](double polar) {
                return !blocked(scene, position, std::cos(polar) * normal + std::sin(polar) * outward, radius);
            },
            samples);
    };
    return turn(at, azimuths, 10) / (2 * std::numbers::pi);
}

Sight::Sight(const Camera& camera) {
    const Caster caster({}, camera);
    const auto corner = caster.ray(0, 0), right = caster.ray(camera.width, 0), below = caster.ray(0, camera.height);
    origin = corner.origin;
    origin_x = (right.origin - corner.origin) / camera.width;
    origin_y = (below.origin - corner.origin) / camera.height;
    direction = corner.direction;
    direction_x = (right.direction - corner.direction) / camera.width;
    direction_y = (below.direction - corner.direction) / camera.height;
    is_orthographic = !origin_x.isZero(0) || !origin_y.isZero(0);
    if (is_orthographic) {
        direction_x.setZero();
        direction_y.setZero();
    }
    ahead = camera.projection.convention.view_axes == fathom::ViewAxes::opengl ? -1 : 1;
}

DepthLayer::DepthLayer(const Camera& camera, std::span<const double> z)
    : width_(camera.width), height_(camera.height), sight_(camera), inverse_depth_(z.size(), nan) {
    for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x) {
            const double depth = z[index(x, y)], start = sight_.ahead * sight_.origin_at(x + 0.5, y + 0.5).z();
            const double w = (depth - start) / (sight_.ahead * sight_.direction_at(x + 0.5, y + 0.5).z());
            if (std::isfinite(depth)) {
                inverse_depth_[index(x, y)] = sight_.is_orthographic ? w : 1 / w;
            } else if (std::isinf(depth)) {
                inverse_depth_[index(x, y)] = infinite;
            }
        }
    const double length = sight_.direction_at(0.5 * width_, 0.5 * height_).norm();
    share_across_ = (sight_.is_orthographic ? sight_.origin_x : sight_.direction_x).norm() / length;
    share_down_ = (sight_.is_orthographic ? sight_.origin_y : sight_.direction_y).norm() / length;
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
    const auto at = [&](int i) { return inverse_depth_[start + stride * static_cast<std::size_t>(i)]; };
    const int nearest = std::clamp(static_cast<int>(std::floor(along)), 0, count - 1);
    if (count == 1)
        return at(nearest);
    const int first = std::clamp(static_cast<int>(std::floor(along - 0.5)), 0, count - 2);
    const double a = at(first), b = at(first + 1);
    const double slope = b - a;
    if (!std::isfinite(slope))
        return at(nearest);
    const double before = first > 0 ? slope - (a - at(first - 1)) : nan;
    const double after = first + 2 < count ? at(first + 2) - b - slope : nan;
    const double allowed =
        std::max(0.5 * std::abs(slope), share_per_pixel * (sight_.is_orthographic ? 1 : std::min(a, b)));
    if (!(std::abs(before) <= allowed || std::abs(after) <= allowed))
        return at(nearest);
    const double inverse_depth = a + (along - 0.5 - first) * slope;
    return inverse_depth > 0 || sight_.is_orthographic ? inverse_depth : infinite;
}

double screen_visibility(const DepthLayer& layer, int x, int y, const Vector3d& normal, const ScreenOptions& options) {
    const double own = layer.inverse_depth(x, y);
    if (!std::isfinite(own))
        return std::isnan(own) ? nan : 1;
    const Sight& sight = layer.sight();
    const Vector2d pixel(x + 0.5, y + 0.5);
    const auto from_inverse_depth = [&](double inverse_depth) {
        return sight.is_orthographic ? inverse_depth : 1 / inverse_depth;
    };
    const Vector3d position =
        sight.origin_at(pixel.x(), pixel.y()) + from_inverse_depth(own) * sight.direction_at(pixel.x(), pixel.y());
    const auto see = [&](const Slice& slice, int k) {
        const Line& line = slice.line;
        const Vector2d place = line.place_at(k);
        const bool by_column = std::abs(line.step.x()) >= std::abs(line.step.y());
        const int across = by_column ? x + (line.step.x() > 0 ? k : -k) : y + (line.step.y() > 0 ? k : -k);
        const double inverse_depth =
            by_column ? layer.between_rows(across, place.y()) : layer.between_columns(across, place.x());
        std::optional<Column> column;
        if (std::isfinite(inverse_depth)) {
            const double w = from_inverse_depth(inverse_depth);
            const Vector2d direction = line.direction_at(k);
            column = {line.origin_at(k) + w * direction, direction.normalized(), 0, 0};
            if (std::isfinite(options.thickness)) {
                const Vector3d ray = sight.direction_at(place.x(), place.y());
                column->depth = sight.ahead * (sight.origin_at(place.x(), place.y()) + w * ray).z();
                column->depth_rate = sight.ahead * ray.normalized().z();
            }
        }
        return column;
    };
    return visibility_of(
        sight, {pixel, Vector2d(layer.width(), layer.height()), position, normal}, options,
        [](const Vector2d& along) -> Vector2d { return along / along.cwiseAbs().maxCoeff(); }, see);
}

} // namespace oracle
