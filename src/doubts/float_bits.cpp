// Tells the bits of floats from numbers, without knowing either's unit.
#include "doubts/look.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <initializer_list>

namespace fathom {

void Bends::add(std::span<const std::uint32_t> line, int mantissa_bits) {
    constexpr std::int64_t least = 10; // codes, which their rounding changes little
    const std::int64_t octave = std::int64_t{1} << mantissa_bits, most = octave * 2 / 5;
    const auto code = [&](std::size_t i) { return static_cast<std::int64_t>(line[i]); };
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
        const std::int64_t power = code(i) / octave;
        if (std::abs(code(i + 1) / octave - power) != 1)
            continue;
        const bool rises = line[i + 1] > line[i];
        // How far codes go in so many pixels on from one, if that is smooth and in one octave.
        const auto run = [&](std::size_t first, std::size_t pixels) -> std::int64_t {
            const std::int64_t all = code(first + pixels) - code(first),
                               even = 3 * std::abs(all) / static_cast<std::int64_t>(pixels) + 2;
            for (std::size_t k = first; k < first + pixels; ++k)
                if (std::abs(code(k + 1) - code(k)) > even || code(k) / octave != code(k + 1) / octave)
                    return 0;
            return rises ? all : -all;
        };
        for (const std::size_t pixels : {1, 2, 4, 8}) {
            if (i < 2 * pixels || i + 1 + 2 * pixels >= line.size())
                break;
            const std::int64_t before = run(i - pixels, pixels), after = run(i + 1, pixels),
                               long_before = run(i - 2 * pixels, pixels), long_after = run(i + 1 + pixels, pixels);
            if (std::min({before, after, long_before, long_after}) < least)
                continue;
            if (std::max({before, after, long_before, long_after}) <= most) {
                const auto log_of = [](std::int64_t a, std::int64_t b) {
                    return std::log2(static_cast<double>(a) / static_cast<double>(b));
                };
                // How steps grow from one run to the next, which the pixel between lengthens, and how they do across it.
                const auto between = static_cast<double>(pixels + 1) / static_cast<double>(pixels);
                const double trend = between * (log_of(before, long_before) + log_of(long_after, after)) / 2,
                             bend = log_of(after, before) - trend; // -1 or 1 for floats, 0 for numbers
                ++((rises ? -bend : bend) > 0.5 ? of_floats : of_numbers);
            }
            break;
        }
    }
}

} // namespace fathom
