// Lenses by name: rays of pixels, and pixels of rays.
//   brown              (u, v) = D(X/Z, Y/Z)                              OpenCV, calib3d: up to 12 coefficients
//   equidistant …      (u, v) = r(θ) (X, Y)/|(X, Y)|                     OpenCV, fisheye (Kannala and Brandt 2006)
//   blender_polynomial the same with θ = −(k0 + k1 r + … + k4 r⁴)        Cycles, kernel/camera/projection.h
//   double_sphere      ray = s (u, v, m) − (0, 0, ξ)                     Usenko, Demmel, Cremers 2018, eq. 41–51
//   equirectangular    ray = (cos φ sin λ, −sin φ, cos φ cos λ)
// A law is one curve or one map; its derivatives come from jets, and its inverse from the Newton steps of solve.hpp.

#include "lens/laws.hpp"

#include "camera/form.hpp"
#include "lens/solve.hpp"
#include "require.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <mutex>
#include <numbers>

namespace fathom {

const char* to_string(LensLaw law) {
    static constexpr const char* names[] = {
        "brown",         "equidistant",        "equisolid",       "stereographic", "opencv-fisheye",
        "double-sphere", "blender-polynomial", "equirectangular", "rays"};
    static_assert(std::size(names) == static_cast<std::size_t>(LensLaw::rays) + 1);
    return names[static_cast<std::size_t>(law)];
}

namespace {

// A map that somebody still has is shared: what a device reads of it is made once, though each frame of a shot reads its file again.
std::shared_ptr<const RayMap> shared_map(RayMap map) {
    static std::mutex mutex;
    static std::vector<std::weak_ptr<const RayMap>> alive;
    const std::scoped_lock lock(mutex);
    std::erase_if(alive, [](const auto& each) { return each.expired(); });
    for (const auto& each : alive)
        if (const auto known = each.lock();
            known && known->width == map.width && known->height == map.height &&
            std::memcmp(known->rays.data(), map.rays.data(), map.rays.size() * sizeof(float)) == 0)
            return known;
    auto made = std::make_shared<const RayMap>(std::move(map));
    alive.push_back(made);
    return made;
}

} // namespace

LensModel lens_of_rays(RayMap map) {
    require(map.width > 0 && map.height > 0 &&
                map.rays.size() == 3 * static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height),
            "a map of rays of ", map.width, " x ", map.height, " pixels has ", map.rays.size(),
            " floats; it must have three a pixel");
    bool has_ray = false, is_ahead = false;
    for (std::size_t i = 0; i < map.rays.size(); i += 3) {
        const float x = map.rays[i], y = map.rays[i + 1], z = map.rays[i + 2], length = std::hypot(x, y, z);
        has_ray |= length > 0 && std::isfinite(length);
        is_ahead |= length > 0 && z > 0;
    }
    require(has_ray, "the map of rays has no ray: all are 0 or not finite");
    require(is_ahead, "no ray of the map points ahead: its axes are x right, y down and z ahead; turn the signs of y "
                      "and z of a map in OpenGL's axes");
    return {.law = LensLaw::rays, .fx = 1, .fy = 1, .cx = 0, .cy = 0, .map = shared_map(std::move(map))};
}

namespace lens {
namespace {

constexpr double half_turn = std::numbers::pi;
constexpr double end_rounding = 1e-9; // relative: a ray of the very fold is seen in its pixel again

// Coefficients of a law, by the names of its makers.
std::vector<const char*> coefficient_names(LensLaw law) {
    switch (law) {
    case LensLaw::brown:
        return {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"};
    case LensLaw::opencv_fisheye:
        return {"k1", "k2", "k3", "k4"};
    case LensLaw::double_sphere:
        return {"xi", "alpha"};
    case LensLaw::blender_polynomial:
        return {"k0", "k1", "k2", "k3", "k4"};
    default:
        return {};
    }
}

void check(const LensModel& model) {
    require_rounding();
    const std::string name = to_string(model.law);
    const std::size_t count = model.k.size(), most = coefficient_names(model.law).size();
    std::string names;
    for (const char* each : coefficient_names(model.law))
        names += (names.empty() ? ": " : " ") + std::string(each);
    if (model.law == LensLaw::brown)
        require(count == 4 || count == 5 || count == 8 || count == 12, "the lens ", name, " has ", count,
                " coefficients; it takes 4, 5, 8 or 12", names,
                count == 14 ? ", and no tilted sensor; write its rays into an image (\"lens\": {\"rays\": FILE})" : "");
    else
        require(count == most, "the lens ", name, " has ", count, " coefficients; it takes ", most,
                model.law == LensLaw::equidistant ? ", and what ROS and Kalibr call so is opencv-fisheye" : names);
    constexpr double most_coefficient = 1e30; // no lens has one near it, and sums of its powers stay finite
    for (const double each : model.k)
        require(std::abs(each) <= most_coefficient, "a coefficient of the lens ", name, " is ", each,
                "; it must be finite, and at most ", most_coefficient);
    for (const auto& [key, value] : {std::pair{"fx", model.fx}, {"fy", model.fy}})
        require(std::isfinite(value) && value > 0, "the lens's ", key, " = ", value, " must be above 0");
    check_pixel_aspect(model.fy, model.fx);
    require(std::isfinite(model.cx) && std::isfinite(model.cy), "the lens's cx = ", model.cx, " and cy = ", model.cy,
            " must be finite");
    require((model.law == LensLaw::rays) == (model.map != nullptr), "the lens ", name,
            model.map ? " takes no map of rays" : " needs a map of rays");
    if (model.law == LensLaw::double_sphere)
        require(std::abs(model.k[0]) < 1 && model.k[1] >= 0 && model.k[1] < 1,
                "the lens double-sphere has xi = ", model.k[0], " and alpha = ", model.k[1],
                "; xi must lie between -1 and 1, alpha from 0 to below 1");
    if (model.law == LensLaw::blender_polynomial) {
        require(model.k[0] == 0, "the lens blender-polynomial has k0 = ", model.k[0],
                "; it must be 0, or no ray runs along the axis");
        require(model.k[1] < 0, "the lens blender-polynomial has k1 = ", model.k[1],
                "; it must be below 0, as Blender writes it");
    }
}

// By what a distorted pinhole multiplies a radius, of which the square is given. OpenCV's order of twelve coefficients.
Jet gain(const std::vector<double>& k, const Jet& square) {
    return (1 + square * (k[0] + square * (k[1] + square * k[4]))) /
           (1 + square * (k[5] + square * (k[6] + square * k[7])));
}

// D of a distorted pinhole.
Two<Jet> distorted(const std::vector<double>& k, const Jet& x, const Jet& y) {
    const Jet square = x * x + y * y, g = gain(k, square);
    return {x * g + 2 * k[2] * x * y + k[3] * (square + 2 * x * x) + square * (k[8] + square * k[9]),
            y * g + k[2] * (square + 2 * y * y) + 2 * k[3] * x * y + square * (k[10] + square * k[11])};
}

} // namespace

Jet Laws::curve(const Jet& at) const {
    const std::vector<double>& k = model_.k;
    const Jet square = at * at;
    switch (model_.law) {
    case LensLaw::brown:
        return at * gain(k, square);
    case LensLaw::equisolid:
        return 2 * sin(at * 0.5);
    case LensLaw::stereographic:
        return 2 * tan(at * 0.5);
    case LensLaw::opencv_fisheye:
        return at * (1 + square * (k[0] + square * (k[1] + square * (k[2] + square * k[3]))));
    case LensLaw::blender_polynomial:
        return at * -1 * (k[1] + at * (k[2] + at * (k[3] + at * k[4])));
    default:
        return at;
    }
}

Laws::Laws(const LensModel& model) : model_(model) {
    check(model);
    if (model.law == LensLaw::brown)
        model_.k.resize(coefficient_names(model.law).size()); // those that are missing are 0
    if (model.map)
        map_pixels_ = MapPixels(*model.map);
    // To find the end takes longer than some operations take for a large image, and each call asks for its lens.
    struct Found {
        LensLaw law;
        std::vector<double> k;
        Rise rise;
        std::optional<LensFold> fold;
        double farthest;
    };
    constexpr std::size_t most_found = 16;
    static std::mutex mutex;
    static std::deque<Found> all;
    const std::scoped_lock lock(mutex);
    const auto known =
        std::ranges::find_if(all, [&](const Found& each) { return each.law == model_.law && each.k == model_.k; });
    if (known != all.end()) {
        rise_ = known->rise;
        fold_ = known->fold;
        farthest_ = known->farthest;
        return;
    }
    rise_ = Rise(curve(), find_end());
    if (model.law == LensLaw::brown && !only_radial())
        farthest_ = find_farthest();
    all.push_front({model_.law, model_.k, rise_, fold_, farthest_});
    if (all.size() > most_found)
        all.pop_back();
}

bool Laws::only_radial() const {
    constexpr std::size_t sideways[] = {2, 3, 8, 9, 10, 11};
    return std::ranges::all_of(sideways, [&](std::size_t i) { return model_.k[i] == 0; });
}

// Follows the curve outwards until it falls, or until it has reached the last angle.
double Laws::find_end() {
    const bool pinhole = model_.law == LensLaw::brown, by_radius = model_.law == LensLaw::blender_polynomial;
    constexpr double last_tangent = 1e4,
                     nearly = 1 - 1e-6; // of 89.994 degrees; of a half turn, whose tangent is infinite
    constexpr double longest = 8;       // times the radius that a straight curve takes to a half turn
    constexpr int steps = 40000;
    const double last = pinhole     ? last_tangent
                        : by_radius ? longest * half_turn / -model_.k[1]
                                    : half_turn * (model_.law == LensLaw::stereographic ? nearly : 1);
    if (!pinhole && !by_radius && model_.law != LensLaw::opencv_fisheye)
        return last;
    // Even steps of the angle, and of the radius.
    const auto place = [&](double share) { return pinhole ? std::tan(share * std::atan(last_tangent)) : share * last; };
    const auto rises = [&](double share) {
        const Jet here = curve(Jet(place(share), 1, 0, 0));
        return here.value >= 0 && std::isfinite(here.value) && here.x > 0;
    };
    const auto is_inside = [&](double share) {
        return rises(share) && (!by_radius || curve(place(share)).value <= half_turn);
    };
    int inside = 0;
    while (inside < steps && is_inside((inside + 1.0) / steps))
        ++inside;
    if (inside == steps)
        return last;
    double low = static_cast<double>(inside) / steps, high = (inside + 1.0) / steps;
    const bool folds = !rises(high);
    for (int bits = 0; bits < 60; ++bits) {
        const double middle = low + (high - low) / 2;
        (is_inside(middle) ? low : high) = middle;
    }
    const double end = place(low);
    if (!folds)
        return end;
    const double there = curve(end).value;
    fold_ = LensFold{pinhole ? std::atan(end) : by_radius ? there : end, by_radius ? end : there, ""};
    // The coefficient without which the curve would rise most there.
    double most = 0;
    for (std::size_t i = 0; i < model_.k.size(); ++i) {
        Laws without = *this;
        without.model_.k[i] = 0;
        if (const double rise = without.curve(Jet(end, 1, 0, 0)).x; rise > most) {
            most = rise;
            fold_->coefficient = coefficient_names(model_.law)[i];
        }
    }
    return end;
}

// Where a distorted pinhole has a place of its image, in tangents.
std::optional<Two<double>> Laws::undistorted(const Two<double>& image) const {
    const double radius = std::hypot(image[0], image[1]);
    if (!only_radial()) {
        const auto map = [this](const Jet& x, const Jet& y) { return distorted(model_.k, x, y); };
        return radius <= farthest_ ? place_from_middle(map, image) : std::nullopt;
    }
    const auto tangent = place_of(curve(), radius, rise_);
    if (!tangent)
        return std::nullopt;
    const double scale = radius > 0 ? *tangent / radius : 1;
    return Two<double>{scale * image[0], scale * image[1]};
}

// The radius up to which places that move sideways are looked for: a little beyond the farthest one in some directions.
double Laws::find_farthest() const {
    constexpr int directions = 16, halves = 12;
    constexpr double most = 4, reserve = 1.05;
    double farthest = 0;
    for (int i = 0; i < directions; ++i) {
        const double angle = 2 * half_turn * i / directions;
        const auto is_seen = [&](double radius) {
            return undistorted({radius * std::cos(angle), radius * std::sin(angle)}).has_value();
        };
        if (is_seen(most))
            return std::numeric_limits<double>::infinity();
        for (double step = most / 2; step > most / (1 << halves); step /= 2)
            farthest += is_seen(farthest + step) ? step : 0;
    }
    return farthest * reserve;
}

std::optional<RayJets> Laws::ray(const Jet& u, const Jet& v) const {
    const Jet one = 1.0, square = u * u + v * v;
    switch (model_.law) {
    case LensLaw::brown: {
        const auto map = [this](const Jet& x, const Jet& y) { return distorted(model_.k, x, y); };
        const auto at = undistorted({u.value, v.value});
        if (!at || !(Linear(map, *at).determinant() > 0))
            return std::nullopt;
        const auto [x, y] = with_derivatives(map, *at, {u, v});
        const Jet inverse = one / sqrt(one + x * x + y * y);
        return RayJets{x * inverse, y * inverse, inverse};
    }
    case LensLaw::double_sphere: {
        const Jet xi = model_.k[0], alpha = model_.k[1], twice = Jet(2.0) * alpha - one;
        if (!(1 - twice.value * square.value >= 0))
            return std::nullopt;
        const Jet m = (one - alpha * alpha * square) / (alpha * sqrt(one - twice * square) + one - alpha);
        const Jet s = (m * xi + sqrt(m * m + (one - xi * xi) * square)) / (m * m + square);
        return RayJets{s * u, s * v, s * m - xi};
    }
    case LensLaw::rays:
        return mapped_ray(*model_.map, u, v);
    case LensLaw::equirectangular: // beyond a pole the other side follows
        return RayJets{cos(v) * sin(u), sin(v), cos(v) * cos(u)};
    default: {
        const double radius = std::sqrt(square.value), middle = curve(Jet(0, 1, 0, 0)).x;
        const bool by_radius = model_.law == LensLaw::blender_polynomial;
        constexpr double small = 1e-6; // below it the curve is straight, and its radius has no derivatives
        if (radius < small) {
            const double slope = by_radius ? middle : 1 / middle;
            return RayJets{Jet(slope) * u, Jet(slope) * v, one - Jet(slope * slope / 2) * square};
        }
        const Jet r = sqrt(square);
        Jet angle;
        if (by_radius) {
            if (radius > rise_.end)
                return std::nullopt;
            angle = curve(r);
        } else {
            const auto place = place_of(curve(), radius, rise_);
            if (!place)
                return std::nullopt;
            angle = with_derivatives(curve(), *place, r);
        }
        const Jet across = sin(angle) / r;
        return RayJets{across * u, across * v, cos(angle)};
    }
    }
}

std::optional<Eigen::Vector2d> Laws::image(const Eigen::Vector3d& direction) const {
    const double length = direction.norm(), x = direction.x() / length, y = direction.y() / length,
                 z = direction.z() / length, across = std::hypot(x, y);
    if (!(length > 0) || !std::isfinite(length))
        return std::nullopt;
    switch (model_.law) {
    case LensLaw::brown: {
        const bool radial = only_radial();
        if (!(z > 0) || (radial && across > rise_.end * (1 + end_rounding) * z))
            return std::nullopt;
        const auto map = [this](const Jet& a, const Jet& b) { return distorted(model_.k, a, b); };
        const Linear here(map, {x / z, y / z});
        if (!(here.determinant() > -end_rounding))
            return std::nullopt;
        const Two<double> image{here.image[0].value, here.image[1].value};
        if (!radial) { // is it the direction of that pixel's ray?
            constexpr double beside_fold = 1e-6;
            const auto seen = undistorted(image);
            if (!seen || std::hypot((*seen)[0] * z - x, (*seen)[1] * z - y) > beside_fold)
                return std::nullopt;
        }
        return Eigen::Vector2d(image[0], image[1]);
    }
    case LensLaw::double_sphere: {
        const double xi = model_.k[0], alpha = model_.k[1];
        const double w1 = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
        const double second = std::hypot(across, xi + z), under = alpha * second + (1 - alpha) * (xi + z);
        // The paper's limit of z (eq. 43) leaves out rays that its inverse gives; that of the second sphere's angle is theirs.
        if (!(xi + z >= -w1 * second * (1 + end_rounding)) || !(under > 0))
            return std::nullopt;
        return Eigen::Vector2d(x / under, y / under);
    }
    case LensLaw::rays:
        return map_pixels_.at(*model_.map, direction / length);
    case LensLaw::equirectangular:
        return Eigen::Vector2d(std::atan2(x, z), std::atan2(y, std::hypot(x, z)));
    default: {
        const double angle = std::atan2(across, z);
        const bool by_radius = model_.law == LensLaw::blender_polynomial;
        if (angle > (by_radius ? rise_.value : rise_.end) * (1 + end_rounding))
            return std::nullopt;
        const auto radius = by_radius ? place_of(curve(), std::min(angle, rise_.value), rise_)
                                      : std::optional(curve(std::min(angle, rise_.end)).value);
        if (across == 0)
            return Eigen::Vector2d(*radius, 0); // straight behind lies on a whole circle
        return Eigen::Vector2d(*radius * x / across, *radius * y / across);
    }
    }
}

} // namespace lens
} // namespace fathom
