// Which function of stored depth is affine in the pixel over a plane. Few surfaces that are bent look flat under a wrong reading, so
// that the one under which many are flat is the right one.
//
// Windows of many sizes are fitted, in units of the stored value. A window counts if one reading leaves no more than its noise, and
// another one clearly more. Noise is what a cubic polynomial leaves, or the storage's rounding.
#include "doubts/planes.hpp"

#include "camera/form.hpp"
#include "doubts/stored_values.hpp"
#include "quantile.hpp"

#include <fathom/pixel_rays.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

namespace fathom {
namespace {

constexpr double least_samples = 0.8 * Window::size;
constexpr double steepest = 4;      // times: no surface rises so much within a window
constexpr double smooth = 0.03;     // of a window's rise, that a cubic polynomial leaves of a surface at most,
constexpr double alike_noise = 1.5; // or so many times the noise from sample to sample, which an edge has not
constexpr double least_steps = 20;  // a window's range, in rounding errors, for a search
constexpr double no_plane = 1e200;  // what a reading leaves that has no rays
constexpr double at_limit = 0.05;   // of a parameter's logarithm

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

std::optional<std::vector<Patch::Place>> places_of(const Window& window, std::span<const int> chosen,
                                                   const View& view) {
    const auto middle = view(window.left + window.width / 2.0, window.top + window.height / 2.0);
    if (!middle)
        return std::nullopt;
    const Eigen::Vector3d right = middle->unitOrthogonal(), down = middle->cross(right);
    std::vector<Patch::Place> places;
    places.reserve(chosen.size());
    for (const int i : chosen) {
        const auto ray = view(window.x(i) + 0.5, window.y(i) + 0.5);
        const double straight = ray ? middle->dot(*ray) : 0;
        if (!(straight > 0))
            return std::nullopt;
        places.push_back({right.dot(*ray) / straight,
                          down.dot(*ray) / straight,
                          {ray->z() / straight, 1 / straight, ray->cwiseAbs().maxCoeff() / straight}});
    }
    return places;
}

// How well a reading fits the third of the patches that it fits best: the logarithm of residuals in roundings.
double cost(std::span<const Patch> patches, const Reading& reading) {
    std::vector<double> each;
    each.reserve(patches.size());
    for (const Patch& patch : patches)
        each.push_back(std::log(std::max(misfit(patch, reading).value_or(no_plane) / patch.rounded, 0.5)));
    const auto third = each.begin() + static_cast<std::ptrdiff_t>((each.size() + 2) / 3);
    std::nth_element(each.begin(), third - 1, each.end());
    double sum = 0;
    for (auto value = each.begin(); value != third; ++value)
        sum += *value;
    return sum / static_cast<double>(third - each.begin());
}

} // namespace

double cubic_misfit(const Patch& patch) {
    std::array<Equation<10>, Window::size> equations;
    for (std::size_t i = 0; i < patch.values.size(); ++i) {
        const double u = patch.window->u(patch.chosen[i]), t = patch.window->t(patch.chosen[i]);
        equations[i].terms << 1, u, t, u * u, u * t, t * t, u * u * u, u * u * t, u * t * t, t * t * t;
        equations[i].value = patch.values[i];
        equations[i].weight = 1;
    }
    return residual<10>(std::span(equations).first(patch.values.size()));
}

std::vector<Window> windows_of(int image_width, int image_height, int width, int height, int most) {
    const int right = image_width - width, bottom = image_height - height,
              across = std::max({width / 2, 4, right / most}), down = std::max({height / 2, 4, bottom / most});
    std::vector<Window> windows;
    for (int y = 0; y <= bottom; y += down)
        for (int x = 0; x <= right; x += across)
            windows.push_back({x, y, width, height});
    return windows;
}

View view_of(const Camera& camera) {
    if (!camera.lens && !camera.projection.is_perspective())
        return {};
    if (!camera.lens) { // in a tenth of the time
        const Rays rays = straight_rays(camera);
        Eigen::Matrix3d to_ray = rays.direction.cast<double>();
        to_ray.row(2) = rays.depth.cast<double>();
        return [to_ray](double x, double y) -> std::optional<Eigen::Vector3d> {
            const Eigen::Vector3d ray = to_ray * Eigen::Vector3d(x, y, 1);
            return (ray.z() < 0 ? -ray : ray).normalized();
        };
    }
    return [rays = PixelRays(camera), ahead = forwards(camera)](double x, double y) {
        auto ray = rays.ray_of(x, y);
        if (ray)
            ray->z() *= ahead;
        return ray;
    };
}

View pinhole_view(int width, int height, double tangent) {
    const double half = 0.5 * width;
    return [=](double x, double y) -> std::optional<Eigen::Vector3d> {
        return Eigen::Vector3d(tangent * (x - half) / half, tangent * (y - 0.5 * height) / half, 1).normalized();
    };
}

View panorama_view(int width, int height) {
    return [=](double x, double y) -> std::optional<Eigen::Vector3d> {
        const double longitude = std::numbers::pi * (2 * x / width - 1),
                     latitude = std::numbers::pi * (y / height - 0.5);
        return Eigen::Vector3d(std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                               std::cos(latitude) * std::cos(longitude));
    };
}

Reading reading_of(const Camera& given, Storage storage, std::optional<double> gamma) {
    const Camera camera = straightened(given);
    const DepthForm form = depth_form(camera, storage);
    Reading reading;
    if (given.lens)
        reading.along = counted_along(given);
    else if (!form.perspective)
        reading.is_parallel = true;
    else {
        const auto centre = static_cast<double>(straight_rays(camera).centre_depth);
        reading.along = is_along_ray(form) ? Along::ray : Along::axis;
        reading.further = (is_along_ray(form) ? static_cast<double>(form.offset) : 0) - centre;
    }
    const auto part = [](const Affine& row, std::size_t i) { return static_cast<double>(row[i]); };
    const auto inverse = [form, n = part(form.numerator, 0), to_n = part(form.numerator, 3),
                          m = part(form.denominator, 0), to_m = part(form.denominator, 3)](double v) -> Inverse {
        if (form.form == Form::exponential) {
            const double rate = std::numbers::ln2 * static_cast<double>(form.rate),
                         power = std::expm1(rate * v + std::numbers::ln2 * static_cast<double>(form.start)),
                         amplitude = static_cast<double>(form.amplitude),
                         length = amplitude * power + static_cast<double>(form.offset);
            return {1 / length, -amplitude * rate * (power + 1) / (length * length)};
        }
        const double above = n * v + to_n, below = m * v + to_m;
        return {below / above, (m * above - n * below) / (above * above)};
    };
    reading.inverse = inverse;
    if (reading.is_parallel)
        reading.inverse = [inverse](double v) -> Inverse {
            const auto [value, change] = inverse(v);
            return {1 / value, -change / (value * value)};
        };
    if (gamma)
        reading.inverse = [then = reading.inverse, largest = storage_max(storage), gamma = *gamma](double v) {
            constexpr double little = 1e-6; // of the range, over which the curve is straight
            const auto at = [&](double part) { return largest * linear_of(std::max(part, 0.0), gamma); };
            Inverse found = then(at(v / largest));
            found.change *= (at(v / largest + little) - at(v / largest - little)) / (2 * little * largest);
            return found;
        };
    return reading;
}

Reading reading_of(Shape shape, double p, double largest, int width, int height) {
    Reading reading;
    if (shape == Shape::ray || shape == Shape::inverse_ray || shape == Shape::panorama) {
        reading.along = Along::ray;
        reading.view = shape == Shape::panorama ? panorama_view(width, height) : pinhole_view(width, height, p);
    }
    const auto of_part = [&]() -> std::function<Inverse(double)> { // of a value as a part of the largest
        switch (shape) {
        case Shape::affine:
        case Shape::inverse_ray:
            return [](double v) -> Inverse { return {v, 1}; };
        case Shape::reciprocal:
        case Shape::ray:
        case Shape::panorama:
            return [](double v) -> Inverse { return {1 / v, -1 / (v * v)}; };
        case Shape::offset:
            return [p](double v) -> Inverse { return {1 / (v + p), -1 / ((v + p) * (v + p))}; };
        case Shape::reversed_offset:
            return [p](double v) -> Inverse { return {1 / (1 + p - v), 1 / ((1 + p - v) * (1 + p - v))}; };
        case Shape::logarithmic:
            return [p](double v) -> Inverse {
                const double e = std::expm1(p * v);
                return {1 / e, -p * (e + 1) / (e * e)};
            };
        case Shape::exponential:
            return [p](double v) -> Inverse { return {std::exp(-p * v), -p * std::exp(-p * v)}; };
        case Shape::display:
            break;
        }
        return [p](double v) -> Inverse {
            constexpr double little = 1e-6;
            const double w = linear_of(v, gamma_of_srgb) + p,
                         change = (linear_of(v + little, gamma_of_srgb) - linear_of(v - little, gamma_of_srgb)) /
                                  (2 * little);
            return {1 / w, -change / (w * w)};
        };
    }();
    reading.inverse = [of_part, largest](double v) {
        Inverse found = of_part(v / largest);
        found.change /= largest;
        return found;
    };
    return reading;
}

std::optional<Patch> patch_of(const Sampled& sampled, const View& view, const Rounding& rounding) {
    Patch patch{.window = &sampled.window};
    for (int i = 0; i < Window::size; ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (std::isfinite(sampled.values[at]) && std::isfinite(sampled.z[at]))
            patch.chosen.push_back(i);
    }
    if (static_cast<double>(patch.chosen.size()) < least_samples)
        return std::nullopt;
    for (const int i : patch.chosen)
        patch.values.push_back(static_cast<double>(sampled.values[static_cast<std::size_t>(i)]));
    const auto [low, high] = std::ranges::minmax(patch.values);
    if (low * high > 0 && steepest < std::max(high / low, low / high)) // through which a reciprocal goes too easily
        return std::nullopt;
    patch.low = low;
    patch.high = high;
    patch.rounded = (rounding.step + rounding.relative_step * std::max(std::abs(low), std::abs(high))) / std::sqrt(12);
    if (!view)
        return patch;
    auto places = places_of(sampled.window, patch.chosen, view);
    if (!places)
        return std::nullopt;
    patch.places = std::move(*places);
    return patch;
}

std::optional<double> misfit(const Patch& patch, const Reading& reading) {
    std::optional<std::vector<Patch::Place>> own;
    if (reading.view && !reading.is_parallel && !(own = places_of(*patch.window, patch.chosen, reading.view)))
        return std::nullopt;
    const std::vector<Patch::Place>& places = own ? *own : patch.places;
    std::array<Equation<3>, Window::size> equations;
    for (std::size_t i = 0; i < patch.values.size(); ++i) {
        auto [value, change] = reading.inverse(patch.values[i]);
        if (reading.is_parallel || places.empty()) {
            equations[i] = {
                {1, patch.window->u(patch.chosen[i]), patch.window->t(patch.chosen[i])}, value, 1 / std::abs(change)};
            continue;
        }
        const auto& [right, down, factors] = places[i];
        const double factor = factors[static_cast<std::size_t>(reading.along)];
        double quotient = factor * value, slope = factor * change;
        if (reading.further != 0) { // z = ahead / value + further, whose inverse counts
            const double ahead = factors[0] / factor, sum = ahead + reading.further * value;
            quotient = factors[0] * value / sum;
            slope = factors[0] * ahead * change / (sum * sum);
        }
        equations[i] = {{1, right, down}, quotient, 1 / std::abs(slope)};
    }
    const double rest = residual<3>(std::span(equations).first(patch.values.size()));
    return std::isfinite(rest) ? std::optional(rest) : std::nullopt;
}

bool is_smooth(const Sampled& sampled, const Patch& patch) {
    if (patch.noise <= std::max(smooth * patch.range(), of_known.flat * patch.rounded))
        return true;
    if (!(patch.low * patch.high > 0 && std::max(patch.high / patch.low, patch.low / patch.high) < 1.1))
        return false; // bars before a wall
    std::vector<double> seconds;
    for (std::size_t i = 0; i + 2 < Window::size; ++i) {
        const double second = static_cast<double>(sampled.values[i]) - 2 * static_cast<double>(sampled.values[i + 1]) +
                              static_cast<double>(sampled.values[i + 2]);
        if (i % Window::across + 2 < Window::across && std::isfinite(second))
            seconds.push_back(std::abs(second));
    }
    constexpr double of_normal = 0.6745 * 2.449489742783178; // its median, and the root of variances of 1, 4 and 1
    return !seconds.empty() && patch.noise <= alike_noise * quantile(seconds) / of_normal;
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

double least_at(const std::function<double(double)>& cost, double least, double greatest, int steps) {
    const double ratio = std::log(greatest / least) / (steps - 1);
    const auto at = [&](double step) { return least * std::exp(ratio * step); };
    const auto cost_at = [&](double step) { return cost(at(step)); };
    int best = 0;
    double lowest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < steps; ++i)
        if (const double value = cost_at(i); value < lowest) {
            lowest = value;
            best = i;
        }
    constexpr double golden = 0.6180339887498949;
    double low = std::max(best - 1, 0), high = std::min(best + 1, steps - 1);
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double at_a = cost_at(a), at_b = cost_at(b);
    for (int i = 0; i < 20; ++i) {
        if (at_a < at_b) {
            high = b;
            b = std::exchange(a, b - golden * (b - low));
            at_b = at_a;
            at_a = cost_at(a);
        } else {
            low = a;
            a = std::exchange(b, a + golden * (high - a));
            at_a = at_b;
            at_b = cost_at(b);
        }
    }
    return at((low + high) / 2);
}

double best_parameter(std::span<const Patch> patches, const std::function<Reading(double)>& make, double least,
                      double greatest, int steps) {
    return least_at([&](double p) { return cost(patches, make(p)); }, least, greatest, steps);
}

std::vector<Patch> some_of(const std::vector<Patch>& patches, std::size_t most) {
    std::vector<Patch> some;
    const std::size_t count = std::min(patches.size(), most);
    for (std::size_t i = 0; i < count; ++i)
        some.push_back(patches[i * patches.size() / count]);
    return some;
}

PlaneFits fit_planes(const std::vector<float>& values, int width, int height, Rounding rounding) {
    constexpr int smallest = 12, longest = 4, across = 24; // pixels; times the other side; windows of one size
    constexpr std::size_t most_of_a_size = 40;             // that are smooth
    double largest = 0, lowest = std::numeric_limits<double>::infinity();
    for (const float value : values)
        if (!std::isnan(value)) {
            largest = std::max(largest, std::abs(static_cast<double>(value)));
            lowest = std::min(lowest, static_cast<double>(value));
        }
    PlaneFits found;
    if (!(largest > 0))
        return found;
    const View view = pinhole_view(width, height, 1);
    std::vector<std::vector<Window>> sizes; // which the patches refer to
    std::vector<Patch> patches;
    for (int w = smallest; w <= width; w *= 2)
        for (int h = smallest; h <= height; h *= 2) {
            if (w > longest * h || h > longest * w)
                continue;
            std::vector<Patch> these;
            for (const Window& window : sizes.emplace_back(windows_of(width, height, w, h, across))) {
                Sampled sampled{window};
                for (int i = 0; i < Window::size; ++i)
                    sampled.values[static_cast<std::size_t>(i)] =
                        values[static_cast<std::size_t>(window.y(i)) * static_cast<std::size_t>(width) +
                               static_cast<std::size_t>(window.x(i))];
                auto patch = patch_of(sampled, view, rounding);
                if (!patch || !(patch->range() > least_steps * patch->rounded))
                    continue;
                patch->window = &window;
                patch->noise = cubic_misfit(*patch);
                if (patch->noise <= smooth * patch->range())
                    these.push_back(std::move(*patch));
            }
            const std::size_t count = std::min(these.size(), most_of_a_size);
            for (std::size_t i = 0; i < count; ++i)
                patches.push_back(std::move(these[i * these.size() / count]));
        }
    found.smooth = patches.size();
    if (patches.empty())
        return found;
    const std::vector<Patch> some = some_of(patches, 120);
    std::vector<Reading> readings;
    const auto add = [&](Shape shape, double limit = 0, double other = 0, int steps = 0) {
        const auto make = [&](double p) { return reading_of(shape, p, largest, width, height); };
        ShapeFit fit{shape};
        if (steps > 0) { // a shape becomes a simpler one beyond its first limit
            fit.parameter = best_parameter(some, make, std::min(limit, other), std::max(limit, other), steps);
            fit.at_limit = std::abs(std::log(fit.parameter / limit)) < at_limit;
        }
        found.shapes.push_back(fit);
        readings.push_back(make(fit.parameter));
    };
    const double least_offset = std::max(1e-4, 1.001 * -lowest / largest);
    add(Shape::affine);
    if (lowest > 0) {
        add(Shape::reciprocal);
        add(Shape::ray, 0.13, 2.75, 14); // from 15 to 140 degrees
        add(Shape::logarithmic, 1.5, 30, 12);
        add(Shape::display, 30, 1e-3, 12);
    }
    if (width == 2 * height)
        add(Shape::panorama);
    add(Shape::offset, 10000 * least_offset, least_offset, 14);
    add(Shape::reversed_offset, 1, 1e-3, 10);
    add(Shape::inverse_ray, 0.13, 2.75, 14);
    add(Shape::exponential, 1, 30, 12);

    std::set<int> places;
    for (const Patch& patch : patches) {
        std::vector<double> misfits;
        for (const Reading& reading : readings)
            misfits.push_back(misfit(patch, reading).value_or(no_plane));
        const double noise = std::max(patch.noise, patch.rounded);
        const std::vector<Verdict> verdicts = judge(misfits, noise, noise, of_searched);
        if (verdicts.empty())
            continue;
        for (std::size_t i = 0; i < misfits.size(); ++i) {
            found.shapes[i].fits += verdicts[i] == Verdict::flat;
            found.shapes[i].fails += verdicts[i] == Verdict::bent;
        }
        ++found.patches;
        places.insert(8 * (patch.window->left + patch.window->width / 2) / width +
                      8 * (6 * (patch.window->top + patch.window->height / 2) / height));
    }
    found.places = places.size();
    return found;
}

} // namespace fathom
