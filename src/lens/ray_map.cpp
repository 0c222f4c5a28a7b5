// A lens as the rays of its pixels. Slopes are central differences of five pixels, which are exact for polynomials of the fourth
// degree, or of as many as there are beside a pixel without a ray.
#include "lens/ray_map.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>

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

// The slope of what `at` gives for steps from a pixel; none without a neighbour.
template <typename At>
Ray slope(const At& at) {
    const Ray here = at(0), after = at(1), before = at(-1);
    if (after && before) {
        const Ray after2 = at(2), before2 = at(-2);
        return after2 && before2 ? Vector((8 * (*after - *before) - (*after2 - *before2)) / 12)
                                 : Vector((*after - *before) / 2);
    }
    return after ? Ray(*after - *here) : before ? Ray(*here - *before) : std::nullopt;
}

// A ray with its derivatives by pixels.
struct Node {
    Vector value, x, y, xy;
};

std::optional<Node> node_of(const RayMap& map, int x, int y) {
    const Ray ray = ray_of(map, x, y);
    if (!ray)
        return std::nullopt;
    const Ray by_x = slope([&](int step) { return ray_of(map, x + step, y); }),
              by_y = slope([&](int step) { return ray_of(map, x, y + step); });
    if (!by_x || !by_y)
        return std::nullopt;
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
    Node sum{Vector::Zero(), Vector::Zero(), Vector::Zero(), Vector::Zero()};
    for (const int i : {0, 1})
        for (const int j : {0, 1}) {
            const double weight = (i ? across : 1 - across) * (j ? down : 1 - down);
            if (weight == 0)
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

Eigen::Vector2d step_towards(const Eigen::Vector3d& direction, const RayJets& ray) {
    Eigen::Matrix<double, 3, 2> slopes;
    Vector off;
    for (int c = 0; c < 3; ++c) {
        const Jet& jet = ray[static_cast<std::size_t>(c)];
        slopes.row(c) << jet.x, jet.y;
        off[c] = direction[c] - jet.value;
    }
    return (slopes.transpose() * slopes).inverse() * slopes.transpose() * off;
}

std::optional<Eigen::Vector2d> mapped_pixel(const RayMap& map, const Eigen::Vector3d& direction) {
    double most = -2;
    int column = 0, row = 0;
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x)
            if (const Ray ray = ray_of(map, x, y); ray && ray->dot(direction) > most) {
                most = ray->dot(direction);
                column = x;
                row = y;
            }
    if (most < 0)
        return std::nullopt;
    Eigen::Vector2d at(column + 0.5, row + 0.5);
    for (int i = 0; i < 8; ++i) {
        const auto jets = mapped_ray(map, Jet(at.x(), 1, 0, 0), Jet(at.y(), 0, 1, 0));
        if (!jets)
            return std::nullopt;
        const Eigen::Vector2d step = step_towards(direction, *jets);
        at += step;
        if (!(step.norm() > 1e-9))
            break;
    }
    const Eigen::Vector2d away = at - Eigen::Vector2d(column + 0.5, row + 0.5);
    return away.cwiseAbs().maxCoeff() <= 1 ? std::optional(at) : std::nullopt;
}

} // namespace fathom::lens
