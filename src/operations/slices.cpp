// Sampling patterns of the occlusion kernels: directions in equal steps over half a turn, shifted from pattern to
// pattern, and distances that grow faster than linearly, shifted by the pattern's other half.

#include "operations/slices.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace fathom {
namespace {

constexpr int patterns = 16;

// Order of the 4 × 4 pixels in which any 2 × 2 of them are far apart.
constexpr int rank_of[patterns] = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};

int rank(int pattern, int used) {
    const int x = pattern % 4, y = pattern / 4;
    constexpr int of_four[] = {0, 2, 3, 1};
    return used == 16 ? rank_of[pattern] : used == 4 ? of_four[(y & 1) * 2 + (x & 1)] : 0;
}

double fraction(double value) {
    return value - std::floor(value);
}

int reversed4(int value) {
    return (value & 1) << 3 | (value & 2) << 1 | (value & 4) >> 1 | (value & 8) >> 3;
}

struct Step {
    int x, y;
};

float single(double value) {
    return static_cast<float>(value);
}

} // namespace

// Distances grow with this power of their number.
constexpr double tap_power = 1.5;

SliceTable slice_table(int slices, int steps, int largest_radius, int patterns_used, double falloff, std::uint32_t seed,
                       PlaneLayout place) {
    SliceTable table{.slices = slices, .steps = steps, .levels = 1, .taps = {}, .turns = {}, .counts = {0}};
    while (std::exp2(table.levels / 2.0) < largest_radius)
        ++table.levels;
    const double scramble = seed * 0.7548776662466927;
    for (int pattern = 0; pattern < patterns; ++pattern) {
        for (int k = 0; k < slices; ++k) {
            const double shift = fraction((rank(pattern, patterns_used) + 0.5) / patterns_used + scramble);
            const double angle = std::numbers::pi * (k + shift) / slices;
            table.turns.push_back(static_cast<float>(std::cos(angle)));
            table.turns.push_back(static_cast<float>(std::sin(angle)));
            const double spread =
                fraction((rank(pattern, patterns_used) * 7 % 16 + 0.5) / patterns + (k + 1) * 0.754877666246693);
            table.turns.push_back(static_cast<float>(1 - falloff * (patterns_used > 1 ? spread : (k + 0.5) / slices)));
            const double rounding = patterns_used > 1 ? fraction(spread * 7) : 0.5;
            table.turns.push_back(static_cast<float>(1.0 / 16 + rounding * 7 / 8));
        }
    }
    for (int level = 1; level <= table.levels; ++level) {
        const double radius = std::exp2(level / 2.0);
        const int count = std::min(steps, static_cast<int>(std::ceil(radius)));
        table.counts.push_back(static_cast<std::uint32_t>(count));
        for (int pattern = 0; pattern < patterns; ++pattern) {
            for (int k = 0; k < slices; ++k) {
                const double cosine = table.turns[static_cast<std::size_t>(4 * (pattern * slices + k))];
                const double sine = table.turns[static_cast<std::size_t>(4 * (pattern * slices + k) + 1)];
                for (int side = 0; side < 2; ++side) {
                    const double shift = patterns_used == 1
                                             ? 0.5
                                             : fraction((reversed4(rank(pattern, patterns_used)) + 0.5) / patterns +
                                                        (2 * k + side) * 0.618033988749895);
                    std::vector<double> distance;
                    for (int i = 0; i < steps; ++i)
                        distance.push_back(std::max(i + 1.0, radius * std::pow((i + shift) / count, tap_power)));
                    for (int i = 0; i < steps; ++i) {
                        const std::size_t at = static_cast<std::size_t>(i);
                        const double s = distance[at];
                        const double sign = side == 0 ? 1 : -1;
                        const int dx = static_cast<int>(std::lround(sign * s * cosine));
                        const int dy = static_cast<int>(std::lround(sign * s * sine));
                        const int px = pattern % 4 + dx, py = pattern / 4 + dy;
                        const double inner = i == 0 ? s / 2 : (s + distance[at - 1]) / 2;
                        const double outer = i + 1 < count ? (s + distance[at + 1]) / 2 : s + (s - inner);
                        const double there = sign * (dx * cosine + dy * sine);
                        const int plane = (py & 3) * 4 + (px & 3) - pattern;
                        table.taps.push_back({.offset = plane * place.plane + (py >> 2) * place.stride + (px >> 2),
                                              .rows_columns = (py >> 2) * 65536 + ((px >> 2) & 0xffff),
                                              .distance = single(there),
                                              .inverse_distance = single(1 / there),
                                              .square_distance = single(there * there),
                                              .aside = single(dx * sine - dy * cosine),
                                              .inner = single(sign * (inner - there)),
                                              .outer = single(sign * (outer - there)),
                                              .inverse_inner = single(1 / inner),
                                              .inverse_outer = single(1 / outer)});
                    }
                }
            }
        }
    }
    for (int level = 1; level <= table.levels; ++level) // the farthest plane's row or column that is looked at
        table.counts.push_back(static_cast<std::uint32_t>(std::ceil(std::exp2(level / 2.0) / 4)) + 2);
    return table;
}

} // namespace fathom
