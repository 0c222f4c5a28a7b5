// Jitter patterns of the occlusion kernels: directions in equal steps over half a turn, and distances that grow faster
// than linearly. Each pattern shifts both by fractions of its own.

#include "operations/ssao/slices.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fathom {
namespace {

constexpr int patterns = params::split_planes;

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
    const auto pixels = [&](double part) { // what is farther away lies outside every image
        return static_cast<int>(
            std::lround(std::clamp(sign * distance * part, -1.0 * longest_side, 1.0 * longest_side)));
    };
    const int x = pixels(cosine), y = pixels(sine);
    return {x, y, sign * (x * cosine + y * sine), x * sine - y * cosine};
}

float single(double value) {
    return static_cast<float>(value);
}

float inverse(double value) {
    return value > 0 ? single(1 / value) : 0;
}

// Distances grow with this power of their number.
constexpr double tap_power = 1.5;

// So few samples on so short a radius begin nearer the pixel, in steps: else, in a crease, some patterns pass over the other wall.
constexpr int few_samples = 10;
constexpr double few_samples_to_px = 32, few_shift = -0.1, few_spread = 0.75;

// Samples grow from this radius on.
constexpr double growth_from_px = 48;

// Samples on a side whose radius covers so many pixels: `samples`, beyond `growth_from_px` times the radius to the power `growth`,
// and never more than there are pixels.
int samples_within(double radius_px, int samples, double growth) {
    const double times = std::clamp(std::sqrt(radius_px / growth_from_px), 1.0, growth);
    return static_cast<int>(std::min(std::round(samples * times), std::ceil(radius_px)));
}

// A slice of one jitter pattern: its direction on the screen, fraction of the radius, and rounding of its sectors.
struct Turn {
    double cosine, sine, of_radius, rounding;
};

class Maker {
public:
    Maker(const Counts& counts, double falloff, std::uint32_t seed, PlaneLayout place)
        : slices_(counts.slices), samples_(counts.samples), jitter_(counts.jitter), growth_(counts.growth),
          falloff_(falloff), scramble_(seed * plastic), place_(place) {}

    Turn turn(int pattern, int slice) const {
        const double shift = fraction((rank(pattern, jitter_) + 0.5) / jitter_ + scramble_);
        const double angle = std::numbers::pi * (slice + shift) / slices_;
        const double spread = fraction((rank(pattern, jitter_) * 7 % 16 + 0.5) / patterns + (slice + 1) * plastic);
        const double alone =
            fraction((slice + 0.5) * golden); // with a single pattern each slice gets its own fraction of the radius
        const double rounding = jitter_ > 1 ? fraction(spread * 7) : 0.5;
        return {std::cos(angle), std::sin(angle), 1 - falloff_ * (jitter_ > 1 ? spread : alone),
                1.0 / 16 + rounding * 7 / 8};
    }

    int count(double radius) const { return samples_within(radius, samples_, growth_); }

    /// Appends the pixel itself, a side's taps, and what lies beyond the last. Returns how many of a plane's rows or
    /// columns they reach.
    int add_taps(std::vector<params::tap_params>& taps, double radius, int pattern, int slice, int side) const {
        const std::vector<double> distance = distances(radius, pattern, 2 * slice + side);
        const Turn t = turn(pattern, slice);
        std::vector<Place> places;
        for (const double s : distance)
            places.push_back(place_at(s, side == 0 ? 1 : -1, t.cosine, t.sine));
        int reach = 0;
        for (std::size_t i = 0; i < places.size(); ++i) {
            const double inner = (distance[i] + (i > 0 ? distance[i - 1] : 0)) / 2;
            const Place& at = places[i];
            const double last = places[i > 0 ? i - 1 : i].along,
                         next = places[std::min(i + 1, places.size() - 1)].along;
            taps.push_back(tap(pattern, at, last, next, i > 1 ? last : inner, inner));
            reach = std::max({reach, std::abs((pattern % 4 + at.x) >> 2), std::abs((pattern / 4 + at.y) >> 2)});
        }
        return reach;
    }

private:
    static constexpr double golden = 0.618033988749895, plastic = 0.7548776662466927;

    std::vector<double> distances(double radius, int pattern, int number) const {
        const bool sparse = samples_ <= few_samples && radius <= few_samples_to_px;
        const double shifted = (rank(pattern, jitter_) * (sparse ? 7 : 5) % 16 + 0.5) / patterns + number * golden;
        const double shift = jitter_ == 1 ? 0.5
                             : sparse     ? few_shift + few_spread * fraction(shifted)
                                          : fraction(shifted);
        std::vector<double> distance{0};
        for (int i = 0; i <= count(radius); ++i) {
            const double part = std::max(i + shift, 0.0) / count(radius);
            distance.push_back(std::max(i + 1.0, radius * std::pow(part, tap_power)));
        }
        return distance;
    }

    params::tap_params tap(int pattern, const Place& at, double last, double next, double low, double inner) const {
        const int x = pattern % 4 + at.x, y = pattern / 4 + at.y;
        const int plane = (y & 3) * 4 + (x & 3) - pattern;
        // Modulo 2^32, as kernels add it: what is so far away lies outside the image.
        const auto rows = static_cast<std::uint32_t>(y >> 2) * static_cast<std::uint32_t>(place_.stride);
        return {.offset = static_cast<std::int32_t>(rows + static_cast<std::uint32_t>(plane * place_.plane + (x >> 2))),
                .rows_columns = (y >> 2) * 65536 + ((x >> 2) & 0xffff),
                .distance = single(at.along),
                .inverse_distance = inverse(at.along),
                .square_distance = single(at.along * at.along),
                .aside = single(at.aside),
                .low = single(low - at.along),
                .high = single(next - at.along),
                .inverse_low = inverse(low),
                .inverse_high = inverse(next),
                .gap = single(at.along - last),
                .before = single(inner - last),
                .after = single(inner - at.along),
                .inverse_inner = inverse(inner)};
    }

    int slices_, samples_, jitter_;
    double growth_, falloff_, scramble_;
    PlaneLayout place_;
};

} // namespace

SliceTable slice_table(const Counts& counts, int largest_radius, double falloff, std::uint32_t seed,
                       PlaneLayout place) {
    const int slices = counts.slices;
    SliceTable table{.slices = slices, .levels = 1, .taps = {}, .turns = {}, .counts = {0}};
    while (std::exp2(table.levels / 2.0) < largest_radius)
        ++table.levels;
    const Maker maker(counts, falloff, seed, place);
    for (int i = 0; i < patterns * slices; ++i) {
        const Turn turn = maker.turn(i / slices, i % slices);
        table.turns.insert(table.turns.end(),
                           {single(turn.cosine), single(turn.sine), single(turn.of_radius), single(turn.rounding)});
    }
    std::vector<std::uint32_t> reaches, firsts;
    for (int level = 1; level <= table.levels; ++level) {
        const double radius = std::exp2(level / 2.0);
        int reach = 0;
        firsts.push_back(static_cast<std::uint32_t>(table.taps.size()));
        for (int i = 0; i < patterns * slices * 2; ++i)
            reach = std::max(reach, maker.add_taps(table.taps, radius, i / (slices * 2), i / 2 % slices, i % 2));
        table.counts.push_back(static_cast<std::uint32_t>(maker.count(radius)));
        reaches.push_back(static_cast<std::uint32_t>(reach));
    }
    table.counts.insert(table.counts.end(), reaches.begin(), reaches.end());
    table.counts.insert(table.counts.end(), firsts.begin(), firsts.end());
    return table;
}

std::size_t slice_table_bytes(const Counts& counts, int largest_radius) {
    const auto sides = static_cast<std::size_t>(patterns * counts.slices * 2);
    std::size_t taps = 0, levels = 0;
    do {
        ++levels;
        const double radius = std::exp2(static_cast<double>(levels) / 2);
        taps += sides * static_cast<std::size_t>(samples_within(radius, counts.samples, counts.growth) + 2);
    } while (std::exp2(static_cast<double>(levels) / 2) < largest_radius);
    return taps * sizeof(params::tap_params) + 4 * (2 * sides + 3 * levels + 1);
}

} // namespace fathom
