// Precision of a stored depth: what storing it in a step of finite size costs in scene units.
// Every form is monotonic in the stored value, so the neighbours of a depth are found by storing it, stepping, decoding.
// The far plane of an oblique frustum is Lengyel 2005, eq. 8; spacings need no source.

#include <fathom/precision.hpp>

#include "require.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fathom {
namespace {

// The stored values on both sides of a depth, inside the stored range.
struct Neighbours {
    double below, above;
};

Neighbours neighbours(const Camera& camera, Storage storage, double x, double y, double z) {
    const DepthForm form = depth_form(camera, storage);
    const auto exact =
        static_cast<double>(std::clamp(stored_depth(camera, storage, x, y, z), static_cast<long double>(form.lowest),
                                       static_cast<long double>(form.highest)));
    if (storage != Storage::float32) {
        const double below = std::min(std::floor(exact), static_cast<double>(form.highest) - 1);
        return {below, below + 1};
    }
    constexpr float infinity = std::numeric_limits<float>::infinity();
    float below = static_cast<float>(exact);
    if (below > exact || below == form.highest)
        below = std::nextafter(below, -infinity);
    return {below, std::nextafter(below, infinity)};
}

// View depth of a stored value. Under a perspective, what lies behind infinity is infinitely far: there 1/z has gone
// through zero, and no surface is stored with such a value. Neighbours may differ by less than a double can tell.
long double surface_depth(const Camera& camera, Storage storage, double x, double y, double stored) {
    const long double z = view_depth(camera, storage, x, y, stored);
    const bool behind_infinity = !(z >= depth_form(camera, storage).least_depth);
    return behind_infinity ? std::numeric_limits<long double>::infinity() : z;
}

} // namespace

Storage storage_of(DepthBits bits) {
    return bits == DepthBits::d16 ? Storage::uint16 : bits == DepthBits::d24 ? Storage::uint24 : Storage::float32;
}

double depth_spacing(const Camera& camera, DepthBits bits, double x, double y, double z) {
    const Storage storage = storage_of(bits);
    const Neighbours stored = neighbours(camera, storage, x, y, z);
    return static_cast<double>(std::abs(surface_depth(camera, storage, x, y, stored.above) -
                                        surface_depth(camera, storage, x, y, stored.below)));
}

double depth_error_bound(const Camera& camera, DepthBits bits, double x, double y, double z) {
    const Storage storage = storage_of(bits);
    const Neighbours stored = neighbours(camera, storage, x, y, z);
    const double half = (stored.above - stored.below) / 2;
    const auto exact = static_cast<double>(stored_depth(camera, storage, x, y, z));
    const DepthForm form = depth_form(camera, storage);
    const auto moved = [&](double by) {
        const double there = std::clamp<double>(exact + by, form.lowest, form.highest);
        return static_cast<double>(std::abs(surface_depth(camera, storage, x, y, there) - z));
    };
    return std::max(moved(half), moved(-half));
}

double attainable_depth(const Camera& camera, double x, double y) {
    const auto at = [&](double stored) {
        return static_cast<double>(surface_depth(camera, Storage::float32, x, y, stored));
    };
    if (camera.encoding != Encoding::window) {
        const DepthForm form = depth_form(camera);
        return std::max(at(form.lowest), at(form.highest));
    }
    const bool far_is_low = camera.projection.order == DepthOrder::reversed;
    return at(camera.depth_range[far_is_low ? 0 : 1]);
}

double pseudo_linear_bound(double nearest, double farthest) {
    require(nearest > 0 && farthest >= nearest && std::isfinite(farthest), "depths from ", nearest, " to ", farthest,
            " must satisfy 0 < nearest <= farthest");
    const double difference = std::sqrt(farthest) - std::sqrt(nearest);
    return difference * difference;
}

} // namespace fathom
