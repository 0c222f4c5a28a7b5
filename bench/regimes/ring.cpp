// Where the radius of ambient occlusion ends on a floor beside a sphere, a ring is seen. It is the fainter, the more of the
// radius occluders fade out over.

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/regime.hpp"

#include "scene/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fathom::regimes {
namespace {

using Eigen::Vector3d;

const Vector3d up = Vector3d(0, 1, 1).normalized(); // the camera looks down at 45 degrees

constexpr int width = 288, height = 224;
constexpr double extent = 4.5, reach = 1, sphere = 1; // scene units: 64 pixels to each
constexpr double band = 0.05;        // of the radius: how wide the rings of floor are that are averaged
constexpr int first = 22, last = 42; // of those rings, about the end of the radius
constexpr int step = 2;              // rings from one slope to the next
constexpr const char* bend = "bend of visibility, per radius";
constexpr const char* off = "error of visibility, rms";

// Rays of a length from a floor meet a sphere that lies on it in a cap of half-angle b around the direction to its centre, as far
// away as c. The cap lies above the horizon: V = 1 - (R / c) sin^2 b.
double beside_sphere(double distance, double length) {
    const double c = std::hypot(distance, sphere);
    const double cosine =
        length >= distance ? distance / c : (c * c + length * length - sphere * sphere) / (2 * c * length);
    return 1 - sphere / c * (1 - std::pow(std::min(cosine, 1.0), 2));
}

// An occluder that fades linearly over the end of the radius is one that is met by some of the lengths there.
double beside_sphere_with(double falloff, double distance) {
    constexpr int lengths = 256;
    double sum = 0;
    for (int i = 0; i < lengths; ++i)
        sum += beside_sphere(distance, reach * (1 - falloff * (i + 0.5) / lengths));
    return sum / lengths;
}

std::size_t at(int ring) {
    return static_cast<std::size_t>(ring);
}

using Profile = std::array<double, last + 1>;

// Means over the floor before the sphere, where it hides nothing.
Profile profile(const scene::Rendered& image, const std::vector<float>& visibility, const Vector3d& contact) {
    Profile sums{};
    std::array<int, last + 1> counts{};
    for (std::size_t i = 0; i < visibility.size(); ++i) {
        const Vector3d away = image.position[i] - contact;
        const double distance = away.norm();
        const int ring = static_cast<int>(distance / (band * reach));
        if (std::abs(away.dot(up)) > 1e-6 || ring < first || ring > last || away.y() > -0.5 * distance)
            continue;
        sums[at(ring)] += static_cast<double>(visibility[i]);
        ++counts[at(ring)];
    }
    for (int i = first; i <= last; ++i)
        sums[at(i)] /= counts[at(i)];
    return sums;
}

// By how much the slope changes from one step to the next, at most.
double bend_of(const Profile& visibility) {
    double most = 0;
    for (int i = first + step; i <= last - step; ++i)
        most = std::max(most, std::abs(visibility[at(i - step)] - 2 * visibility[at(i)] + visibility[at(i + step)]));
    return most / (step * band);
}

double off_by(const Profile& visibility, const Profile& truth) {
    double sum = 0;
    for (int i = first; i <= last; ++i)
        sum += std::pow(visibility[at(i)] - truth[at(i)], 2);
    return std::sqrt(sum / (last - first + 1));
}

Profile exact(double falloff) {
    Profile profile{};
    for (int i = first; i <= last; ++i)
        profile[at(i)] = beside_sphere_with(falloff, (i + 0.5) * band * reach);
    return profile;
}

} // namespace

Regime ring_of_a_radius(const Device& device) {
    Regime regime{"ring", "falloff"};
    const Camera camera = camera_over(
        orthographic({-extent / 2, extent / 2, -0.5 * extent * height / width, 0.5 * extent * height / width},
                     {0.5, 20}),
        width, height);
    const Vector3d contact(0, 0.2 * extent, -10);
    const scene::Scene scene{scene::Plane{contact, up}, scene::Sphere{contact + sphere * up, sphere}};
    const scene::Rendered image = scene::render(scene, camera);
    const StoredDepth stored = images::stored_of(device, image.stored, camera);
    for (const double falloff : {0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0}) {
        const Profile truth = exact(falloff);
        regime.panel(bend).curve("exact").points.push_back({falloff, bend_of(truth)});
        for (const auto& [name, quality] :
             {std::pair{"fast", Quality::fast}, {"balanced", Quality::balanced}, {"accurate", Quality::accurate}}) {
            SsaoOptions options{.sampling = Sampling{.quality = quality}};
            options.falloff = falloff;
            const Profile found = profile(image, images::floats(ssao(stored, reach, options).visibility), contact);
            regime.panel(bend).curve(name).points.push_back({falloff, bend_of(found)});
            regime.panel(off).curve(name).points.push_back({falloff, off_by(found, truth)});
        }
    }
    regime.boundaries = {
        {bend, "exact", 0.2, 0.3, 0.2, "closed form"}, {bend, "fast", 0.2, 0.6, 0.5, "measured"},
        {bend, "balanced", 0.2, 0.5, 0.4, "measured"}, {bend, "accurate", 0.2, 0.5, 0.4, "measured"},
        {off, "fast", 0.012, 0, none, "measured"},     {off, "balanced", 0.01, 0, none, "measured"},
        {off, "accurate", 0.01, 0, none, "measured"},
    };
    return regime;
}

} // namespace fathom::regimes
