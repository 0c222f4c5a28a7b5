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
constexpr int rank_of[patterns] = {0, 9, 6, 15, 4, 13, 10, 3, 8, 1, 14, 7, 12, 5, 2, 11};

int rank(int pattern, int used) {
    const int x = pattern % 4, y = pattern / 4;
    constexpr int of_four[] = {0, 2, 3, 1};
    return used == 16 ? rank_of[pattern] : used == 4 ? of_four[(y & 1) * 2 + (x & 1)] : 0;
}

double fraction(double value) {
    return value - std::floor(value);
}

// A pixel near a slice.
struct Place {
    int x, y;     // from the centre
    double along; // the slice, outwards
    double aside; // from it to the slice
};

Place place_at(double distance, double sign, double cosine, double sine) {
    const int x = static_cast<int>(std::lround(sign * distance * cosine));
    const int y = static_cast<int>(std::lround(sign * distance * sine));
    return {x, y, sign * (x * cosine + y * sine), x * sine - y * cosine};
}

float single(double value) {
    return static_cast<float>(value);
}

float inverse(double value) {
    return value > 0 ? single(1 / value) : 0;
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
    std::vector<std::uint32_t> reaches;
    for (int level = 1; level <= table.levels; ++level) {
        const double radius = std::exp2(level / 2.0);
        const int count = std::min(steps, static_cast<int>(std::ceil(radius)));
        table.counts.push_back(static_cast<std::uint32_t>(count));
        int reach = 0;
        for (int pattern = 0; pattern < patterns; ++pattern) {
            for (int k = 0; k < slices; ++k) {
                const double cosine = table.turns[static_cast<std::size_t>(4 * (pattern * slices + k))];
                const double sine = table.turns[static_cast<std::size_t>(4 * (pattern * slices + k) + 1)];
                for (int side = 0; side < 2; ++side) {
                    const double shift = patterns_used == 1
                                             ? 0.5
                                             : fraction((rank(pattern, patterns_used) * 5 % 16 + 0.5) / patterns +
                                                        (2 * k + side) * 0.618033988749895);
                    std::vector<double> distance{0};
                    for (int i = 0; i <= steps; ++i)
                        distance.push_back(std::max(i + 1.0, radius * std::pow((i + shift) / count, tap_power)));
                    std::vector<Place> places;
                    for (const double s : distance)
                        places.push_back(place_at(s, side == 0 ? 1 : -1, cosine, sine));
                    for (std::size_t i = 0; i < places.size(); ++i) {
                        const Place &at = places[i], last = i > 0 ? places[i - 1] : at,
                                    next = i + 1 < places.size() ? places[i + 1] : at;
                        const int px = pattern % 4 + at.x, py = pattern / 4 + at.y;
                        const int plane = (py & 3) * 4 + (px & 3) - pattern;
                        if (static_cast<int>(i) <= count + 1)
                            reach = std::max({reach, std::abs(px >> 2), std::abs(py >> 2)});
                        const double inner = (distance[i] + (i > 0 ? distance[i - 1] : 0)) / 2;
                        const double low = i > 1 ? last.along : inner;
                        table.taps.push_back({.offset = plane * place.plane + (py >> 2) * place.stride + (px >> 2),
                                              .rows_columns = (py >> 2) * 65536 + ((px >> 2) & 0xffff),
                                              .distance = single(at.along),
                                              .inverse_distance = inverse(at.along),
                                              .square_distance = single(at.along * at.along),
                                              .aside = single(at.aside),
                                              .low = single(low - at.along),
                                              .high = single(next.along - at.along),
                                              .inverse_low = inverse(low),
                                              .inverse_high = inverse(next.along),
                                              .gap = single(at.along - last.along),
                                              .before = single(inner - last.along),
                                              .after = single(inner - at.along),
                                              .inverse_inner = inverse(inner)});
                    }
                }
            }
        }
        reaches.push_back(static_cast<std::uint32_t>(reach));
    }
    table.counts.insert(table.counts.end(), reaches.begin(), reaches.end());
    return table;
}

} // namespace fathom
