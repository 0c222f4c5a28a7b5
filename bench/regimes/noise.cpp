// A sensor's noise: depth in millimetres, of which each is off by up to so many, evenly and independently.

#include "camera_over.hpp"
#include "images.hpp"
#include "regimes/corner.hpp"
#include "regimes/normal_bound.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace fathom::regimes {
namespace {

constexpr const char* lost = "visibility lost by a plane, rms";
constexpr const char* by_neighbours = "neighbours";
constexpr const char* by_told_neighbours = "neighbours, tolerance told";
constexpr const char* by_fit = "least squares";
constexpr const char* by_told_fit = "least squares, tolerance told";
constexpr const char* by_noise = "noise told";
constexpr const char* plain = "as it is";
constexpr const char* told = "tolerance told";

Camera sensor() {
    Camera camera = camera_over(perspective(1.0, static_cast<double>(corner_width) / corner_height, {0.1, 100}),
                                corner_width, corner_height);
    camera.encoding = Encoding::view_z;
    camera.scale = 0.001;
    return camera;
}

std::vector<std::uint16_t> measured(const scene::Rendered& truth, unsigned millimetres) {
    std::mt19937 random(1);
    std::vector<std::uint16_t> codes;
    for (const double z : truth.z) {
        const double off = static_cast<double>(random() % (2 * millimetres + 1)) - millimetres;
        codes.push_back(static_cast<std::uint16_t>(std::lround(z * 1000 + off)));
    }
    return codes;
}

double largest_bound(const Corner& corner, double tolerance) {
    const NormalBound bound(corner.camera(), Storage::uint16, tolerance);
    const scene::Rendered& truth = corner.truth();
    double largest = 0;
    for (int y = 0; y < truth.height; ++y)
        for (int x = 0; x < truth.width; ++x) {
            const auto i = static_cast<std::size_t>(y * truth.width + x);
            if (corner.away_from_edges(x, y))
                largest = std::max(largest, bound.degrees(x, y, truth.z[i], truth.normal[i]));
        }
    return largest;
}

double lost_by(const Device& device, const scene::Rendered& plane, unsigned noise, double tolerance) {
    const auto codes = measured(plane, noise);
    SsaoOptions options = Corner::options();
    options.border = Border::open; // a plane does not go on as its border's pixels
    options.tolerance = tolerance;
    double sum = 0;
    for (const float v : images::floats(
             ssao(images::stored_of(device, codes, sensor(), Storage::uint16), corner_radius, options).visibility))
        sum += std::pow(1 - static_cast<double>(v), 2);
    return std::sqrt(sum / static_cast<double>(codes.size()));
}

} // namespace

Regime noise_on_depth(const Device& device) {
    Regime regime{"noise-on-depth", "noise, relative to z"};
    const Corner corner(sensor());
    const scene::Rendered plane = scene::render({scene::Plane{{0, 0, -corner_depth}, {0.5, 0, 0.866}}}, sensor());
    for (const unsigned noise : {1u, 2u, 4u, 8u, 16u, 32u, 64u, 128u, 256u, 512u, 1024u, 2048u, 4096u}) {
        const double relative = noise / (1000 * corner_depth), tolerance = 1 + 2.0 * noise; // half steps of 1/2 mm
        const auto codes = measured(corner.truth(), noise);
        const StoredDepth stored = images::stored_of(device, codes, sensor(), Storage::uint16);
        const auto put = [&](const char* quantity, const char* curve, double error, double bound = none) {
            regime.panel(quantity).curve(curve).points.push_back({relative, error, bound});
        };
        const auto normals_off = [&](const NormalsOptions& options) {
            return corner.normals_off(images::floats(normals(stored, options)));
        };
        put(quantity::normal, by_neighbours, normals_off({.method = NormalMethod::neighbours}));
        put(quantity::normal, by_told_neighbours,
            normals_off({.method = NormalMethod::neighbours, .tolerance = tolerance}),
            largest_bound(corner, tolerance));
        put(quantity::normal, by_fit, normals_off({.method = NormalMethod::least_squares}));
        put(quantity::normal, by_told_fit,
            normals_off({.method = NormalMethod::least_squares, .tolerance = tolerance}));
        put(quantity::normal, by_noise, normals_off({.noise = relative / std::numbers::sqrt3}));
        SsaoOptions options = Corner::options();
        put(quantity::visibility, plain,
            corner.visibility_off(images::floats(ssao(stored, corner_radius, options).visibility)));
        options.tolerance = tolerance;
        put(quantity::visibility, told,
            corner.visibility_off(images::floats(ssao(stored, corner_radius, options).visibility)));
        put(lost, plain, lost_by(device, plane, noise, 1));
        put(lost, told, lost_by(device, plane, noise, tolerance));
    }
    regime.boundaries = {
        {quantity::normal, by_neighbours, 5, 2.1e-4, 3.9e-4, "measured"},
        {quantity::normal, by_told_fit, 5, 1.7e-3, 3.1e-3, "measured"},
        {quantity::normal, by_noise, 5, 1.7e-3, 3.1e-3, "measured"},
        {quantity::visibility, plain, 0.03, 1.7e-3, 3.1e-3, "measured"},
        {quantity::visibility, told, 0.03, 4.1e-4, 7.9e-4, "measured"},
        {lost, plain, 0.01, 8.1e-4, 1.5e-3, "measured"},
        {lost, told, 0.01, 0.11, 0.2, "measured"},
    };
    return regime;
}

} // namespace fathom::regimes
