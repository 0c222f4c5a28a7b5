// Looks at depth once, row after row: what is invalid, how far away the rest is, and samples of how it changes.
#include "doubts/look.hpp"

#include "doubts/stored_values.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <utility>

namespace fathom {
namespace {

constexpr std::size_t most_of_a_map = 300; // colours: 256, a sky and some more

// In lanes, which compilers work on at once: they do not reorder a minimum of floats themselves.
Look look_of(const HostFloats& floats) {
    constexpr std::size_t lanes = 16;
    constexpr float infinity = std::numeric_limits<float>::infinity();
    std::array<float, lanes> least{}, greatest{};
    least.fill(infinity);
    greatest.fill(-infinity);
    Look all;
    all.pixels = static_cast<std::size_t>(floats.width) * static_cast<std::size_t>(floats.height);
    for (int y = 0; y < floats.height; ++y) {
        std::array<std::int32_t, lanes> nan{}, infinite{};
        const auto count = [&](float value, std::size_t lane) {
            nan[lane] += value != value;
            infinite[lane] += value == infinity;
            const float low = value > -infinity ? value : infinity, high = value < infinity ? value : -infinity;
            least[lane] = low < least[lane] ? low : least[lane];
            greatest[lane] = high > greatest[lane] ? high : greatest[lane];
        };
        const std::span<const float> row = row_of(floats, y);
        std::size_t x = 0;
        for (; x + lanes <= row.size(); x += lanes)
            for (std::size_t lane = 0; lane < lanes; ++lane)
                count(row[x + lane], lane);
        for (; x < row.size(); ++x)
            count(row[x], 0);
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            all.invalid += static_cast<std::size_t>(nan[lane]);
            all.background += static_cast<std::size_t>(infinite[lane]);
        }
    }
    all.nearest = *std::ranges::min_element(least);
    all.farthest = *std::ranges::max_element(greatest);
    return all;
}

} // namespace

void Look::add(const HostFloats& more) {
    const bool is_first = surfaces() == 0;
    const Look next = look_of(more);
    pixels += next.pixels;
    invalid += next.invalid;
    background += next.background;
    if (next.surfaces() == 0)
        return;
    nearest = is_first ? next.nearest : std::min(nearest, next.nearest);
    farthest = is_first ? next.farthest : std::max(farthest, next.farthest);
}

void ValueChanges::add(const HostDepth& row) {
    float before = std::numeric_limits<float>::quiet_NaN(), middle = before;
    visit_values(row, [&](float value, std::uint32_t bits) {
        low_bits[bits & 7] += bits != 0;
        if (const float second = std::abs(before - 2 * middle + value); second > 0)
            least_second = std::min(least_second, second);
        highest = std::isfinite(value) ? std::max(highest, value) : highest;
        before = middle;
        middle = value;
    });
    if (row.storage == Storage::uint16)
        add_codes(row);
    if (pixel_bytes(row.storage) == 3)
        add_bytes(row);
}

void ValueChanges::add_bytes(const HostDepth& row) {
    const bool first_is_high = row.storage == Storage::bgr8_red_low || row.storage == Storage::rgb8_red_high;
    const std::uint8_t* last = nullptr;
    std::array<int, 2> before_wrap{}; // how both bytes changed last
    visit_pixels<std::uint8_t>(row, 3, [&](const std::uint8_t* bytes) {
        if (last) {
            const int high = first_is_high ? 0 : 2, step = bytes[high] - last[high], below = bytes[1] - last[1];
            constexpr int smooth = 16;
            const bool is_step = step != 0 && std::abs(step) <= smooth;
            steps += is_step;
            alike += is_step && std::abs(below) <= smooth;
            carried += is_step && std::abs(256 * step + below) < 96;
            if (is_step)
                stepping.set(bytes[high]);
            for (const int end : {high, 2 - high}) {
                const int up = bytes[end] - last[end];
                const bool is_carry = std::abs(up) == 1 && up * below <= -128;
                carries[end == high ? 0 : 1] += is_carry;
                if (is_carry && end != high)
                    carried_into_lowest.set(bytes[end]);
            }
            for (const std::size_t upper : {0, 1}) {
                const int at = upper == 0 ? high : 1, under = upper == 0 ? 1 : 2 - high, change = bytes[at] - last[at],
                          change_under = std::abs(bytes[under] - last[under]);
                constexpr int small = 32; // to which noise may move the colour of a pixel
                if (change != 0 && std::abs(change) <= small) {
                    ++small_steps[upper];
                    small_below[upper] += change_under <= small;
                    frozen[upper] += change_under == 0;
                    if (change_under <= small)
                        steady_values[upper].set(bytes[at]);
                }
                // Where the byte below wraps, a surface goes on as before.
                const int both = 256 * change + bytes[under] - last[under];
                wraps[upper] += change_under >= 128 && std::abs(both - before_wrap[upper]) <= 2 * small;
                before_wrap[upper] = both != 0 ? both : before_wrap[upper];
                values_below[upper].set(bytes[under]);
            }
        }
        ends_differ |= std::abs(bytes[0] - bytes[2]) > 1; // rounding
        ++pixels_of_three;
        if (std::abs(bytes[0] - bytes[2]) == 255) {
            ++full[(bytes[0] == 255) == first_is_high ? 1 : 0];
            between.set(bytes[1]);
        }
        if (colors.size() <= most_of_a_map && !(last && std::equal(bytes, bytes + 3, last)))
            colors.insert(std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8 | std::uint32_t{bytes[2]} << 16);
        last = bytes;
    });
}

void ValueChanges::add_codes(const HostDepth& row) {
    std::vector<std::uint32_t> codes;
    codes.reserve(static_cast<std::size_t>(row.width));
    visit_values(row, [&](float, std::uint32_t bits) { codes.push_back(bits); });
    bends.add(codes, 10);
    for (std::size_t x = 0; x < codes.size(); ++x) {
        if (x > 0)
            add_neighbours(codes[x - 1], codes[x]);
        if (x < codes_before_.size())
            add_neighbours(codes_before_[x], codes[x]);
    }
    for (const std::uint32_t code : codes) {
        const bool is_end = code == 0 || code == 0x8000 || code == 0xfc00 || (code >= 0x7c00 && code <= 0x7e00);
        const bool is_half = !is_end && code >= 0x2800 && code < 0x7c00; // from 1/32 on
        half_ends += code == 0x7c00;
        half_codes += is_half;
        no_half_codes += !is_end && !is_half;
        if (is_half)
            highest_half = std::max(highest_half, code);
        no_fives += code % 5 != 0;
        odd_fives += code % 10 == 5;
        odd_eighths += code >= 0x8000 && code < 0xffff && (code & 8) != 0;
    }
    codes_before_ = std::move(codes);
}

void ValueChanges::add_neighbours(std::uint32_t one, std::uint32_t other) {
    if (one == 0 || other == 0)
        return;
    constexpr int alike = 512, jump = 0x2000;
    const auto between = [&](int left) { // once both are rotated
        const auto code = [&](std::uint32_t v) { return int{std::rotl(static_cast<std::uint16_t>(v), left)}; };
        return std::abs(code(one) - code(other));
    };
    neighbours += one != other;
    const int change = between(0);
    const bool is_other_end = ((one ^ other) & 7) != 0, is_jump = change >= jump;
    if (!is_other_end && !is_jump)
        return;
    differ_below += is_other_end;
    alike_below += is_other_end && change < alike;
    alike_right += is_jump && is_other_end && between(-3) <= alike;
    alike_left += is_jump && between(3) <= alike / 8;
}

bool ValueChanges::may_be_halves() const {
    return half_codes > 64 && 100 * no_half_codes <= half_codes;
}

bool ValueChanges::are_turned_round() const {
    return carries[1] >= 32 && 8 * carries[0] <= carries[1] && carried_into_lowest.count() >= 4;
}

// Of OpenCV's maps AUTUMN changes one channel only, beside one of 255 and one of 0. Numbers whose bytes are like that lie in the
// first or the last 256th of their range.
bool ValueChanges::are_of_one_channel(bool is_buffer) const {
    constexpr std::size_t few_values = 32, few_others = 32;
    return 8 * (full[0] + (is_buffer ? 0 : full[1])) > pixels_of_three && between.count() >= few_values &&
           colors.size() <= between.count() + few_others;
}

bool ValueChanges::are_of_a_picture(bool is_buffer) const {
    if (are_turned_round())
        return false;
    if (are_of_one_channel(is_buffer))
        return true;
    // Where a byte of a number steps, the byte below runs through all of its values. Colours of a map change little from one entry to
    // the next, and of many colours, as where a map was filtered, one rises after another. A number of 16 bits that fills 24 has its
    // highest byte again as the lowest.
    constexpr std::size_t few_steps = 32, few_values = 8;
    const auto& steady = colors.size() <= most_of_a_map ? small_below : frozen;
    for (const std::size_t upper : {0, 1})
        if ((upper == 0 || ends_differ) && small_steps[upper] > few_steps &&
            5 * steady[upper] >= 3 * small_steps[upper] && 100 * wraps[upper] < small_steps[upper] &&
            steady_values[upper].count() >= few_values && values_below[upper].count() >= few_values)
            return true;
    return steps > 64 && stepping.count() >= 16 && values_below[0].count() > 2 && 5 * alike >= 3 * steps &&
           33 * carried < steps;
}

Subject::Subject(const Camera& seen, Storage stored_as, int most, int growth)
    : camera(seen), storage(stored_as), numbers(seen, stored_as) {
    // Large windows see the curvature of values that are rounded or noisy, and small ones lie between the edges of narrow surfaces.
    for (int side = Window::across; side <= std::min(seen.width, seen.height); side *= growth)
        for (const Window& window : windows_of(seen.width, seen.height, side, side, most))
            windows.push_back({window});
}

void Subject::add_row(const HostDepth& row) {
    changes.add(row);
    numbers.add(row);
}

void Subject::add(const HostDepth& values, const HostFloats& z) {
    look.add(z);
    for (Sampled& sampled : windows) {
        const Window& window = sampled.window;
        if (window.top >= rows_ + values.height || window.top + window.height <= rows_)
            continue;
        for (int i = 0; i < Window::size; ++i) {
            const int x = window.x(i), y = window.y(i) - rows_;
            const auto at = static_cast<std::size_t>(i);
            if (y < 0 || y >= values.height)
                continue;
            visit_values(part_of(values, x, y, 1, 1), [&](float value, std::uint32_t) { sampled.values[at] = value; });
            sampled.z[at] = row_of(z, y)[static_cast<std::size_t>(x)];
        }
    }
    constexpr int most_rows = 128;
    for (int y = 0; y < values.height; ++y)
        if ((rows_ + y) % (1 + camera.height / most_rows) == 0)
            add_row(part_of(values, 0, y, values.width, 1));
    rows_ += values.height;
}

} // namespace fathom
