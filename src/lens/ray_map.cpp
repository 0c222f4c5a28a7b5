// A lens as the rays of its pixels. Slopes are central differences of five pixels, which are exact for polynomials of the fourth
// degree, or of as many as there are beside a pixel without a ray.
#include "lens/laws.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>

namespace fathom::lens {
namespace {

using Vector = Eigen::Vector3d;
using Ray = std::optional<Vector>;

Ray ray_of(const RayMap& map, int x, int y) {
    if (x < 0 || y < 0 || x >= map.width || y >= map.height)
        return std::nullopt;
    const auto at =
        3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) + static_cast<std::size_t>(x));
    const Vector ray = Eigen::Map<const Eigen::Vector3f>(&map.rays[at]).cast<double>();
    const double length = ray.norm();
    return length > 0 && std::isfinite(length) ? Ray(ray / length) : std::nullopt;
}

// The slope of what `at` gives for steps from a pixel, between the nearest others; none where all are far.
template <typename At>
Ray slope(const At& at) {
    constexpr int farthest = 16;
    for (int far = 1; far <= farthest; ++far) {
        const Ray after = at(far), before = at(-far);
        if (far == 1 && after && before)
            if (const Ray after2 = at(2), before2 = at(-2); after2 && before2)
                return Vector((8 * (*after - *before) - (*after2 - *before2)) / 12);
        if (after || before)
            return Vector((after.value_or(*at(0)) - before.value_or(*at(0))) / (far * (after && before ? 2 : 1)));
    }
    return std::nullopt;
}

// A ray with its derivatives by pixels.
struct Node {
    Vector value, x, y, xy;
};

std::optional<Node> node_of(const RayMap& map, int x, int y) {
    const Ray ray = ray_of(map, x, y);
    if (!ray)
        return std::nullopt;
    Ray by_x = slope([&](int step) { return ray_of(map, x + step, y); }),
        by_y = slope([&](int step) { return ray_of(map, x, y + step); });
    if (!by_x && !by_y)
        by_x = ray->unitOrthogonal(); // a radian a pixel: nobody can say
    if (!by_x)
        by_x = by_y->cross(*ray); // pixels are square
    if (!by_y)
        by_y = ray->cross(*by_x);
    const Ray a = ray_of(map, x + 1, y + 1), b = ray_of(map, x - 1, y + 1), c = ray_of(map, x + 1, y - 1),
              d = ray_of(map, x - 1, y - 1);
    return Node{*ray, *by_x, *by_y, a && b && c && d ? Vector((*a - *b - *c + *d) / 4) : Vector::Zero()};
}

} // namespace

std::optional<RayJets> mapped_ray(const RayMap& map, const Jet& x, const Jet& y) {
    const double left = std::floor(x.value - 0.5), top = std::floor(y.value - 0.5);
    const double across = x.value - 0.5 - left, down = y.value - 0.5 - top;
    if (!(left >= -1 && top >= -1 && left < map.width && top < map.height))
        return std::nullopt;
    constexpr double no_weight = 1e-12; // a position in a row of pixels, but for its rounding
    Node sum{Vector::Zero(), Vector::Zero(), Vector::Zero(), Vector::Zero()};
    for (const int i : {0, 1})
        for (const int j : {0, 1}) {
            const double weight = (i ? across : 1 - across) * (j ? down : 1 - down);
            if (weight <= no_weight)
                continue;
            const auto node = node_of(map, static_cast<int>(left) + i, static_cast<int>(top) + j);
            if (!node)
                return std::nullopt;
            sum.value += weight * node->value;
            sum.x += weight * node->x;
            sum.y += weight * node->y;
            sum.xy += weight * node->xy;
        }
    const double length = sum.value.norm();
    RayJets jets;
    for (int i = 0; i < 3; ++i) // rows may go up: y.y is the sign
        jets[static_cast<std::size_t>(i)] = {sum.value[i] / length, sum.x[i] * x.x, sum.y[i] * y.y,
                                             sum.xy[i] * x.x * y.y};
    return jets;
}

namespace {

constexpr double half_pixel = 0.5 + 1e-6;

// Newton's step in pixels from where a lens sees `ray` to where it sees the unit vector `direction`, by least squares.
Eigen::Vector2d step_towards(const Vector& direction, const RayJets& ray) {
    Eigen::Matrix<double, 3, 2> slopes;
    Vector off;
    for (int c = 0; c < 3; ++c) {
        const Jet& jet = ray[static_cast<std::size_t>(c)];
        slopes.row(c) << jet.x, jet.y;
        off[c] = direction[c] - jet.value;
    }
    if (off.isZero(0)) // also where neighbours have the same ray
        return Eigen::Vector2d::Zero();
    return (slopes.transpose() * slopes).inverse() * slopes.transpose() * off;
}

std::optional<RayJets> ray_at(const RayMap& map, const Eigen::Vector2d& at) {
    return mapped_ray(map, Jet(at.x(), 1, 0, 0), Jet(at.y(), 0, 1, 0));
}

Eigen::Vector2d centre_of(const Eigen::Vector2i& pixel) {
    return pixel.cast<double>() + Eigen::Vector2d(0.5, 0.5);
}

// Squared.
double distance(const RayMap& map, const Eigen::Vector2i& pixel, const Vector& direction) {
    const Ray ray = ray_of(map, pixel.x(), pixel.y());
    return ray ? (*ray - direction).squaredNorm() : std::numeric_limits<double>::infinity();
}

// The pixel whose ray is the nearest one, from another on: the best of eight around it, as long as there is a better one, by ever
// smaller steps. Pixels that are far from square need one of Newton's now and then.
Eigen::Vector2i nearest(const RayMap& map, const Vector& direction, Eigen::Vector2i at, int step) {
    double least = distance(map, at, direction);
    const auto is_nearer = [&](const Eigen::Vector2i& other) {
        const double there = distance(map, other, direction);
        if (!(there < least))
            return false;
        least = there;
        at = other;
        return true;
    };
    while (step > 0) {
        bool moved = false;
        const Eigen::Vector2i middle = at;
        for (const int j : {-step, 0, step})
            for (const int i : {-step, 0, step})
                moved |= is_nearer(middle + Eigen::Vector2i(i, j));
        if (!moved && step == 1) {
            Eigen::Vector2d way = step_towards(direction, *ray_at(map, centre_of(at)));
            const double most = std::max(map.width, map.height), length = way.cwiseAbs().maxCoeff();
            for (way *= std::min(1.0, most / length); !moved && way.cwiseAbs().maxCoeff() > 1; way /= 2)
                moved = is_nearer(at + way.array().round().matrix().cast<int>());
        }
        if (!moved)
            step /= 2;
    }
    return at;
}

// Where a direction is seen beside a pixel whose ray is near it, at most a pixel away from its centre.
std::optional<Eigen::Vector2d> beside(const RayMap& map, const Vector& direction, const Eigen::Vector2d& centre) {
    constexpr int most_steps = 20;
    constexpr double near = 1e-9;
    Eigen::Vector2d at = centre;
    for (int i = 0; i < most_steps; ++i) {
        const Eigen::Vector2d before = at;
        // Beside the last row or column with rays, and beyond it, from there.
        for (const Eigen::Vector2d& from : {before, {before.x(), centre.y()}, {centre.x(), before.y()}, centre})
            if (const auto jets = ray_at(map, from)) {
                at = from + step_towards(direction, *jets);
                break;
            }
        if (!((at - centre).cwiseAbs().maxCoeff() <= 1))
            return std::nullopt;
        if ((at - before).norm() <= near)
            break;
    }
    return at;
}

} // namespace

MapPixels::MapPixels(const RayMap& map) {
    constexpr double cells = 1024;
    step_ = static_cast<int>(std::ceil(std::sqrt(1.0 * map.width * map.height / cells)));
    for (int top = 0; top < map.height; top += step_)
        for (int left = 0; left < map.width; left += step_) {
            const auto add = [&](int x, int y) {
                const Ray ray = ray_of(map, x, y);
                if (ray)
                    some_.push_back({{x, y}, *ray});
                return ray.has_value();
            };
            bool added = add(left + step_ / 2, top + step_ / 2);
            for (int i = 0; i < step_ * step_ && !added; ++i)
                added = add(left + i % step_, top + i / step_);
        }
}

std::optional<Eigen::Vector2d> MapPixels::at(const RayMap& map, const Vector& direction) const {
    // A map may meet itself: around a panorama, or at its poles.
    std::array<Pixel, 4> starts;
    const auto far = [&](const Pixel& each) { return (each.ray - direction).squaredNorm(); };
    const auto end = std::ranges::partial_sort_copy(some_, starts, {}, far, far).out;
    std::optional<Eigen::Vector2d> found;
    for (auto start = starts.begin(); start != end; ++start) {
        const Eigen::Vector2i pixel = nearest(map, direction, start->at, step_);
        if (!(distance(map, pixel, direction) < 2)) // 90 degrees
            continue;
        const auto at = beside(map, direction, centre_of(pixel));
        if (at && (*at - centre_of(pixel)).cwiseAbs().maxCoeff() <= half_pixel)
            return at;
        found = found ? found : at;
    }
    return found;
}

} // namespace fathom::lens
