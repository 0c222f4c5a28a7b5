// Which function of stored depth is affine in the pixel over a plane.
//
// A plane n·P = d holds the points P = z (X, Y, 1) of a perspective, where X and Y are affine in the pixel. So 1/z is
// affine in the pixel over every plane, and so is a stored value's own function of it. Windows of many sizes are fitted,
// in units of the stored value, each shape with one parameter for the whole image. A window counts if one shape leaves
// no more than its noise, and another one clearly more. Noise is what a cubic polynomial leaves, or the storage's
// rounding.
#include "doubts/plane_fits.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

namespace fathom {
namespace {

constexpr int smallest_window = 12;         // pixels; each next size is twice as large
constexpr int longest_window = 4;           // times its other side
constexpr int windows_across = 24;          // of one size, at most
constexpr std::size_t most_of_a_size = 40;  // smooth windows of one size that are kept
constexpr std::size_t most_to_search = 120; // windows that the parameters are found with
constexpr double least_steps = 20;          // a window's range, in rounding errors
constexpr double smooth = 0.03;             // residual of a cubic, as a part of the range
constexpr double at_limit = 0.05;           // of a parameter's logarithm

struct Patch {
    std::vector<PlaneSample> samples; // x and y are from the middle of the image, in half its width
    double rounding, noise;
    int place;
};

// An equation for each sample: a sum of N functions is to be a value, in units of 1/weight.
template <int N>
struct Equation {
    Eigen::Matrix<double, N, 1> terms;
    double value, weight;
};

// The root of the mean square that the best sum leaves.
template <int N>
double residual(std::span<Equation<N>> equations) {
    Eigen::Matrix<double, N, N> a = Eigen::Matrix<double, N, N>::Zero();
    Eigen::Matrix<double, N, 1> b = Eigen::Matrix<double, N, 1>::Zero();
    double mean = 0, weights = 0;
    for (const auto& each : equations) {
        mean += each.weight * each.weight * each.value;
        weights += each.weight * each.weight;
    }
    mean /= weights;
    for (auto& each : equations) {
        each.value -= mean; // values that differ in their last digits only keep these
        const double squared = each.weight * each.weight;
        a.noalias() += each.terms * (squared * each.terms).transpose();
        b.noalias() += each.terms * (squared * each.value);
    }
    const Eigen::Matrix<double, N, 1> solution = a.ldlt().solve(b);
    double sum = 0;
    for (const auto& each : equations) {
        const double rest = each.weight * (each.value - each.terms.dot(solution));
        sum += rest * rest;
    }
    return std::sqrt(sum / static_cast<double>(equations.size() - N));
}

// Of the stored values of an image, in units of the largest.
struct Patches {
    const std::vector<float>& values;
    int width, height;
    Rounding rounding;
    double largest;

    std::vector<Patch> smooth_ones() const {
        std::vector<Patch> found;
        for (int w = smallest_window; w <= width; w *= 2)
            for (int h = smallest_window; h <= height; h *= 2)
                if (w <= longest_window * h && h <= longest_window * w)
                    add_size(w, h, found);
        return found;
    }

    void add_size(int w, int h, std::vector<Patch>& found) const {
        std::vector<Patch> these;
        for (const Window& window : windows_of(width, height, w, h, windows_across))
            if (Patch patch; is_smooth(window, patch))
                these.push_back(std::move(patch));
        const std::size_t count = std::min(these.size(), most_of_a_size);
        for (std::size_t i = 0; i < count; ++i)
            found.push_back(std::move(these[i * these.size() / count]));
    }

    bool is_smooth(const Window& window, Patch& patch) const {
        patch.samples.reserve(Window::size);
        const double half = 0.5 * width;
        for (int i = 0; i < Window::size; ++i) {
            const int x = window.x(i), y = window.y(i);
            const auto index =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
            const double v = static_cast<double>(values[index]) / largest;
            if (!std::isnan(v))
                patch.samples.push_back(
                    {(x + 0.5 - half) / half, (y + 0.5 - 0.5 * height) / half, window.u(i), window.t(i), v});
        }
        if (static_cast<double>(patch.samples.size()) < least_samples)
            return false;
        const auto [least, greatest] = std::ranges::minmax(patch.samples, {}, &PlaneSample::v);
        const double range = greatest.v - least.v;
        patch.rounding = rounding.in(patch.samples);
        if (!(range > least_steps * patch.rounding))
            return false;
        const double rest = cubic_misfit(patch.samples);
        patch.noise = std::max(rest, patch.rounding);
        patch.place =
            8 * (window.left + window.width / 2) / width + 8 * (6 * (window.top + window.height / 2) / height);
        return rest <= smooth * range;
    }
};

// How well a shape fits the third of the windows that it fits best: the logarithm of residuals in roundings.
double cost(const std::vector<const Patch*>& patches, Shape shape, double parameter) {
    std::vector<double> each;
    each.reserve(patches.size());
    for (const Patch* patch : patches)
        each.push_back(std::log(std::max(misfit(patch->samples, shape, parameter) / patch->rounding, 0.5)));
    const auto third = each.begin() + static_cast<std::ptrdiff_t>((each.size() + 2) / 3);
    std::nth_element(each.begin(), third - 1, each.end());
    double sum = 0;
    for (auto value = each.begin(); value != third; ++value)
        sum += *value;
    return sum / static_cast<double>(third - each.begin());
}

// The parameter that fits best: the best of a geometric grid, made finer by golden sections.
double best_parameter(const std::vector<const Patch*>& patches, Shape shape, double least, double greatest, int count) {
    const double ratio = std::log(greatest / least) / (count - 1);
    const auto at = [&](double step) { return least * std::exp(ratio * step); };
    int best = 0;
    double lowest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < count; ++i)
        if (const double value = cost(patches, shape, at(i)); value < lowest) {
            lowest = value;
            best = i;
        }
    constexpr double golden = 0.6180339887498949;
    double low = std::max(best - 1, 0), high = std::min(best + 1, count - 1);
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double at_a = cost(patches, shape, at(a)), at_b = cost(patches, shape, at(b));
    for (int i = 0; i < 20; ++i) {
        if (at_a < at_b) {
            high = b;
            b = std::exchange(a, b - golden * (b - low));
            at_b = at_a;
            at_a = cost(patches, shape, at(a));
        } else {
            low = a;
            a = std::exchange(b, a + golden * (high - a));
            at_a = at_b;
            at_b = cost(patches, shape, at(b));
        }
    }
    return at((low + high) / 2);
}

// Counts the patches that tell the shapes apart.
void count_patches(const std::vector<Patch>& patches, double largest, PlaneFits& found) {
    std::set<int> places;
    std::vector<double> noise, each(found.shapes.size());
    for (const Patch& patch : patches) {
        for (std::size_t i = 0; i < each.size(); ++i)
            each[i] = misfit(patch.samples, found.shapes[i].shape, found.shapes[i].parameter);
        const std::vector<Verdict> verdicts = judge(each, patch.noise, patch.noise, of_searched);
        if (verdicts.empty())
            continue;
        for (std::size_t i = 0; i < each.size(); ++i) {
            found.shapes[i].fits += verdicts[i] == Verdict::flat;
            found.shapes[i].fails += verdicts[i] == Verdict::bent;
        }
        ++found.patches;
        places.insert(patch.place);
        noise.push_back(patch.noise * largest);
    }
    found.places = places.size();
    if (!noise.empty()) {
        const auto middle = noise.begin() + static_cast<std::ptrdiff_t>(noise.size() / 2);
        std::nth_element(noise.begin(), middle, noise.end());
        found.noise = *middle;
    }
}

// On a plane 1/v is linear in the unit ray u, so that 1/(v e u) is affine in where u meets the plane across e.
double panorama_misfit(std::span<const PlaneSample> patch) {
    std::array<Eigen::Vector3d, Window::size> rays;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < patch.size(); ++i) {
        const double longitude = std::numbers::pi * patch[i].x, latitude = std::numbers::pi * patch[i].y;
        rays[i] = {std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                   std::cos(latitude) * std::cos(longitude)};
        middle += rays[i];
    }
    middle.normalize();
    const Eigen::Vector3d right = middle.unitOrthogonal(), down = middle.cross(right);
    std::array<PlaneSample, Window::size> places;
    std::array<PlaneQuantity, Window::size> quantities;
    for (std::size_t i = 0; i < patch.size(); ++i) {
        const double straight = middle.dot(rays[i]), v = patch[i].v;
        places[i] = {0, 0, right.dot(rays[i]) / straight, down.dot(rays[i]) / straight, v};
        quantities[i] = {1 / (straight * v), straight * v * v};
    }
    return misfit(std::span(places).first(patch.size()), std::span(quantities).first(patch.size()));
}

} // namespace

std::vector<Window> windows_of(int image_width, int image_height, int width, int height, int most) {
    const int right = image_width - width, bottom = image_height - height,
              across = std::max({width / 2, 4, right / most}), down = std::max({height / 2, 4, bottom / most});
    std::vector<Window> windows;
    for (int y = 0; y <= bottom; y += down)
        for (int x = 0; x <= right; x += across)
            windows.push_back({x, y, width, height});
    return windows;
}

double Rounding::in(std::span<const PlaneSample> patch) const {
    double largest = 0;
    for (const PlaneSample& sample : patch)
        largest = std::max(largest, std::abs(sample.v));
    return (step + relative_step * largest) / std::sqrt(12);
}

double cubic_misfit(std::span<const PlaneSample> patch) {
    std::array<Equation<10>, Window::size> equations;
    for (std::size_t i = 0; i < patch.size(); ++i) {
        const auto& [x, y, u, t, v] = patch[i];
        equations[i].terms << 1, u, t, u * u, u * t, t * t, u * u * u, u * u * t, u * t * t, t * t * t;
        equations[i].value = v;
        equations[i].weight = 1;
    }
    return residual<10>(std::span(equations).first(patch.size()));
}

std::vector<Verdict> judge(std::span<const double> misfits, double noise, double least, const Bars& bars) {
    const auto [best, worst] = std::ranges::minmax(misfits);
    const double floor = std::max(best, least);
    if (!(best <= bars.flat * noise && worst > bars.apart * floor))
        return {};
    std::vector<Verdict> verdicts;
    for (const double misfit : misfits)
        verdicts.push_back(misfit <= bars.fits * floor   ? Verdict::flat
                           : misfit > bars.fails * floor ? Verdict::bent
                                                         : Verdict::none);
    return verdicts;
}

PlaneQuantity quantity_of(Shape shape, double p, const PlaneSample& at) {
    const double v = at.v;
    const auto ray = [&] { return std::sqrt(1 + (at.x * at.x + at.y * at.y) * p * p); };
    switch (shape) {
    case Shape::affine:
        return {v, 1};
    case Shape::reciprocal:
        return {1 / v, v * v};
    case Shape::offset:
        return {1 / (v + p), (v + p) * (v + p)};
    case Shape::reversed_offset:
        return {1 / (1 + p - v), (1 + p - v) * (1 + p - v)};
    case Shape::ray: {
        const double s = ray();
        return {s / v, v * v / s};
    }
    case Shape::inverse_ray: {
        const double s = ray();
        return {s * v, 1 / s};
    }
    case Shape::logarithmic: {
        const double e = std::expm1(p * v);
        return {1 / e, e * e / (p * (e + 1))};
    }
    case Shape::exponential: {
        const double e = std::exp(-p * v);
        return {e, 1 / (p * e)};
    }
    case Shape::panorama:
        break;
    }
    return {v, 1};
}

double misfit(std::span<const PlaneSample> patch, std::span<const PlaneQuantity> quantities) {
    std::array<Equation<3>, Window::size> equations;
    for (std::size_t i = 0; i < patch.size(); ++i)
        equations[i] = {{1, patch[i].u, patch[i].t}, quantities[i].value, quantities[i].change};
    return residual<3>(std::span(equations).first(patch.size()));
}

double misfit(std::span<const PlaneSample> patch, Shape shape, double parameter) {
    if (shape == Shape::panorama)
        return panorama_misfit(patch);
    std::array<PlaneQuantity, Window::size> quantities;
    for (std::size_t i = 0; i < patch.size(); ++i)
        quantities[i] = quantity_of(shape, parameter, patch[i]);
    return misfit(patch, std::span(quantities).first(patch.size()));
}

PlaneFits fit_planes(const std::vector<float>& values, int width, int height, Rounding rounding) {
    double largest = 0, lowest = std::numeric_limits<double>::infinity();
    for (const float value : values)
        if (!std::isnan(value)) {
            largest = std::max(largest, std::abs(static_cast<double>(value)));
            lowest = std::min(lowest, static_cast<double>(value));
        }
    PlaneFits found;
    if (!(largest > 0))
        return found;
    rounding.step /= largest;
    const std::vector<Patch> patches = Patches{values, width, height, rounding, largest}.smooth_ones();
    found.smooth = patches.size();
    if (patches.empty())
        return found;
    std::vector<const Patch*> some;
    const std::size_t count = std::min(patches.size(), most_to_search);
    for (std::size_t i = 0; i < count; ++i)
        some.push_back(&patches[i * patches.size() / count]);

    found.shapes.push_back({Shape::affine});
    // A shape becomes a simpler one beyond its first limit.
    const auto add = [&](Shape shape, double limit, double other, int steps) {
        ShapeFit fit{shape, best_parameter(some, shape, std::min(limit, other), std::max(limit, other), steps)};
        fit.at_limit = std::abs(std::log(fit.parameter / limit)) < at_limit;
        found.shapes.push_back(fit);
    };
    const double least_offset = std::max(1e-4, 1.001 * -lowest / largest);
    if (lowest > 0) {
        found.shapes.push_back({Shape::reciprocal});
        add(Shape::ray, 0.13, 2.75, 14); // from 15 to 140 degrees
        add(Shape::logarithmic, 1.5, 30, 12);
    }
    if (width == 2 * height)
        found.shapes.push_back({Shape::panorama});
    add(Shape::offset, 10000 * least_offset, least_offset, 14);
    add(Shape::reversed_offset, 1, 1e-3, 10);
    add(Shape::inverse_ray, 0.13, 2.75, 14);
    add(Shape::exponential, 1, 30, 12);
    count_patches(patches, largest, found);
    return found;
}

} // namespace fathom
