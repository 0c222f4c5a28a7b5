// Depth that a renderer averages over its pixels as it averages light: on an edge it is a mean of both sides. Beside a sky 1/z of such
// a mean is hardly more than the sky's, so that no ramp is to be seen in it. But the mean says how much of the pixel is near:
//   v = t v_near + (1 - t) v_far
// and a pixel of which half is near gets the near side's depth, as its middle has it.
#include "camera/photograph.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace fathom {
namespace {

constexpr float step = 0.1f;    // of an edge, in the logarithm of z
constexpr float of_step = 0.1f; // that a side may change from a pixel to the next
// How far a mean is from either side, at least, and in what that side changes from a pixel to the next. Before a sky a rounded surface
// turns away at its silhouette, and means are farther off.
constexpr float off = 0.02f, times = 2, off_sky = 0.2f, times_sky = 4;
constexpr std::size_t most_means = 3; // pixels side by side: a filter is hardly wider, and a slanted edge crosses two
constexpr float few_steps = 2.2f;     // of 1/z as it is stored: a far floor has two side by side
constexpr std::size_t few_means = 64;

// The least amount by which 1/z changes from a pixel of a line to the next: a step, if it was stored in steps.
float least_change(std::span<const float> z) {
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i + 1 < z.size(); ++i)
        if (const float change = std::abs(1 / z[i + 1] - 1 / z[i]); change > 0)
            least = std::min(least, change);
    return std::isinf(least) ? 0 : least;
}

// Calls a function with the pixels on both sides of each edge along a line of distances, between which are up to three means.
template <typename Visit>
void visit_edges(std::span<const float> z, const Visit& visit) {
    const float least_height = few_steps * least_change(z);
    const auto apart = [&](std::size_t i, std::size_t j) { return z[i] == z[j] ? 0 : std::abs(std::log(z[j] / z[i])); };
    const float least_ratio = std::exp(step);
    const auto is_edge = [&](std::size_t left, std::size_t right) {
        if (!(z[right] >= least_ratio * z[left] || z[left] >= least_ratio * z[right]) || // as nearly everywhere
            !(z[left] > 0 && z[right] > 0))
            return false;
        const float all = apart(left, right), before = apart(left, left - 1), behind = apart(right, right + 1);
        if (!(before <= of_step * all && behind <= of_step * all &&
              std::abs(1 / z[right] - 1 / z[left]) >= least_height))
            return false;
        const bool has_sky = std::isinf(all);
        const float least = std::max(has_sky ? off_sky : off, (has_sky ? times_sky : times) * std::max(before, behind));
        for (std::size_t i = left; i < right; ++i)
            if (!((z[i + 1] - z[i]) * (z[right] - z[left]) >= 0) ||
                (i > left && !(std::min(apart(i, left), apart(i, right)) >= least)))
                return false;
        return true;
    };
    // The widest first: beside a sky what is hardly near may pass for the sky itself.
    for (std::size_t left = 1; left + 2 < z.size(); ++left)
        for (std::size_t right = std::min(left + 1 + most_means, z.size() - 2); right > left; --right)
            if (is_edge(left, right)) {
                visit(left, right);
                left = right - 1;
                break;
            }
}

// The distance that a side of an edge has so many pixels farther on, if its last three pixels are those of a plane, or its own.
float goes_on(std::span<const float> z, std::size_t side, std::size_t to) {
    constexpr float part = 0.25f, rounding = 1e-6f; // of the slope, and of 1/z
    const auto inverse = [&](std::size_t i) { return 1 / z[i]; };
    const bool is_right = to < side;
    if (is_right ? side + 2 >= z.size() : side < 2)
        return z[side];
    const std::size_t behind = is_right ? side + 1 : side - 1, last = is_right ? side + 2 : side - 2;
    const float slope = inverse(side) - inverse(behind), before = inverse(behind) - inverse(last),
                away = static_cast<float>(is_right ? side - to : to - side), made = inverse(side) + away * slope;
    const bool is_plane = std::abs(slope - before) <= part * std::abs(slope) + rounding * inverse(side);
    return is_plane && made > 0 ? 1 / made : z[side];
}

} // namespace

void EdgeCounts::add_distances(std::span<const float> z) {
    visit_edges(z, [&](std::size_t left, std::size_t right) { ++(right - left > 1 ? means : clean); });
}

bool EdgeCounts::are_means() const {
    return means > 3 * clean && means >= few_means;
}

std::vector<float> without_means(const HostFloats& z, const HostFloats& open, bool of_inverse) {
    const auto width = static_cast<std::size_t>(z.width), height = static_cast<std::size_t>(z.height);
    std::vector<float> made(z.data, z.data + width * height), steps(made.size());
    EdgeCounts counts;
    const auto along = [&](std::size_t first, std::size_t next, std::size_t length) {
        std::vector<float> line(length);
        for (std::size_t i = 0; i < length; ++i)
            line[i] = open.data[first + i * next];
        visit_edges(line, [&](std::size_t left, std::size_t right) {
            ++(right - left > 1 ? counts.means : counts.clean);
            const auto value = [&](std::size_t i) {
                return of_inverse ? -1 / static_cast<double>(line[i]) : static_cast<double>(line[i]);
            };
            const double one = value(left), other = value(right);
            const float height_of = std::abs(std::log(line[right] / line[left]));
            for (std::size_t i = left + 1; i < right; ++i) {
                const std::size_t at = first + i * next;
                if (!(height_of > steps[at])) // the higher one of two edges counts
                    continue;
                steps[at] = height_of;
                const double of_other = (value(i) - one) / (other - one);
                const bool is_other = of_other > 0.5 || (of_other == 0.5 && line[right] < line[left]);
                const std::size_t side = is_other ? right : left;
                const float its = z.data[first + side * next];
                made[at] = std::isfinite(its) ? goes_on(line, side, i) : its;
            }
        });
    };
    for (std::size_t y = 0; y < height; ++y)
        along(y * width, 1, width);
    for (std::size_t x = 0; x < width; ++x)
        along(x, width, height);
    return counts.are_means() ? made : std::vector<float>();
}

} // namespace fathom
