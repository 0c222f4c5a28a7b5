// Stored depth without holes, on the host.

#include <fathom/linearize.hpp>

#include "operations/moved_values.hpp"

#include <cmath>
#include <vector>

namespace fathom {
namespace {

constexpr int none = -1;

// The place of the nearest valid pixel before and behind each of a line, the farther of the two; none if there is none.
void farther_sides(int count, const auto& z_at, const auto& take) {
    std::vector<int> before(static_cast<std::size_t>(count));
    for (int i = 0, last = none; i < count; ++i) {
        last = std::isnan(z_at(i)) ? last : i;
        before[static_cast<std::size_t>(i)] = last;
    }
    for (int i = count - 1, behind = none; i >= 0; --i) {
        behind = std::isnan(z_at(i)) ? behind : i;
        const int other = before[static_cast<std::size_t>(i)];
        const bool take_other = other != none && (behind == none || z_at(other) >= z_at(behind));
        take(i, take_other ? other : behind);
    }
}

} // namespace

void fill_invalid(const StoredDepth& stored, const Image& result) {
    check_stored(stored);
    MovedValues pixels(stored, result);
    for (int y = 0; y < pixels.height; ++y) {
        const std::vector<float> row(pixels.z.begin() + static_cast<std::ptrdiff_t>(pixels.at(0, y)),
                                     pixels.z.begin() + static_cast<std::ptrdiff_t>(pixels.at(0, y + 1)));
        farther_sides(
            pixels.width, [&](int x) { return row[static_cast<std::size_t>(x)]; },
            [&](int x, int from) {
                if (from == none)
                    return;
                pixels.take(pixels.at(x, y), pixels.values, pixels.at(from, y));
                pixels.z[pixels.at(x, y)] = row[static_cast<std::size_t>(from)];
            });
    }
    for (int x = 0; x < pixels.width; ++x)
        farther_sides(
            pixels.height, [&](int y) { return pixels.z[pixels.at(x, y)]; },
            [&](int y, int from) {
                if (from != none && from != y)
                    pixels.take(pixels.at(x, y), pixels.moved, pixels.at(x, from));
            });
    pixels.write(result);
}

StoredDepth fill_invalid(const StoredDepth& stored) {
    return with_moved_values(stored, [&](const Image& result) { fill_invalid(stored, result); });
}

} // namespace fathom
