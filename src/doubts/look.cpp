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

} // namespace

void Look::add(const HostFloats& more) {
    for (int y = 0; y < more.height; ++y)
        for (const float z : row_of(more, y)) {
            const bool is_first = surfaces() == 0;
            ++pixels;
            invalid += std::isnan(z);
            background += z == std::numeric_limits<float>::infinity();
            if (!std::isfinite(z))
                continue;
            nearest = is_first ? z : std::min(nearest, z);
            farthest = is_first ? z : std::max(farthest, z);
        }
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
    int last_change = 0;              // of the code
    std::array<int, 2> before_wrap{}; // how both bytes changed last
    visit_pixels<std::uint8_t>(row, 3, [&](const std::uint8_t* bytes) {
        if (last) {
            const int high = first_is_high ? 0 : 2, step = bytes[high] - last[high], below = bytes[1] - last[1];
            constexpr int smooth = 16;
            const bool is_step = step != 0 && std::abs(step) <= smooth;
            steps += is_step;
            alike += is_step && std::abs(below) <= smooth;
            carried += is_step && std::abs(256 * step + below) < 96;
            const int lowest = bytes[2 - high] - last[2 - high], change = 65536 * step + 256 * below + lowest;
            straight += is_step && std::abs(lowest) > smooth && std::abs(change - last_change) < 4096; // 1/16 of a step
            last_change = change;
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
        lower_bytes.set(code & 0xff);
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
    constexpr int little = 256; // beside flags
    const int change = between(0);
    // A fourth of them says as much.
    for (std::size_t i = 0; i < rotations.size() && one != other && neighbours % 4 == 0; ++i)
        change_bits[i] += static_cast<std::size_t>(std::bit_width(static_cast<unsigned>(between(rotations[i]))));
    if (((one ^ other) & 0xe000) != 0) {
        ++differ_above;
        alike_below_13 += std::abs(int(one & 0x1fff) - int(other & 0x1fff)) <= little;
    }
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

bool ValueChanges::are_of_base_255() const {
    constexpr std::size_t nearly_all = 250, enough = 4096; // values, and pixels
    return pixels_of_three >= enough && std::ranges::all_of(values_below, [](const auto& seen) {
               return seen.count() >= nearly_all && seen[254] && !seen[255];
           });
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
    if (are_turned_round() || (steps > 64 && 2 * straight > steps))
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

Subject::Subject(const Camera& seen, const HostDepth& stored, Closely closely)
    : Subject(seen, stored, HostFloats{}, closely) {}

Subject::Subject(const Camera& seen, const HostDepth& stored, const HostFloats& z, Closely how)
    : camera(seen), storage(stored.storage), closely(how), whole(stored), numbers(seen, stored),
      form_(depth_form(straightened(seen), stored.storage)), rays_(is_along_ray(form_) ? camera_rays(seen) : Rays{}),
      given_(z) {
    std::ranges::transform(form_.numerator, numerator_.begin(), [](long double v) { return static_cast<double>(v); });
    std::ranges::transform(form_.denominator, denominator_.begin(),
                           [](long double v) { return static_cast<double>(v); });
    const bool is_some = closely == Closely::some;
    // Large windows see the curvature of values that are rounded or noisy, and small ones lie between the edges of narrow surfaces.
    const int most_windows = is_some ? 2 : 12, growth = is_some ? 4 : 2;
    const int smallest = is_some && std::min(whole.width, whole.height) >= 256 ? 4 * Window::across : Window::across;
    for (int side = smallest; side <= std::min(whole.width, whole.height); side *= growth)
        for (const Window& window : windows_of(whole.width, whole.height, side, side, most_windows)) {
            Sampled& sampled = windows.emplace_back(Sampled{window});
            for (int i = 0; i < Window::size; ++i)
                visit_values(part_of(whole, window.x(i), window.y(i), 1, 1), [&](float value, std::uint32_t bits) {
                    sampled.values[static_cast<std::size_t>(i)] = value;
                    sampled.z[static_cast<std::size_t>(i)] = depth(window.x(i), window.y(i), value, bits);
                });
        }
    if (!given_.data || closely != Closely::whole)
        take_sample(is_some                    ? 24
                    : closely == Closely::most ? 320
                                               : whole.width,
                    is_some                    ? 24
                    : closely == Closely::most ? 180
                                               : whole.height);
    look.add(this->z());
    // Neighbours count in rows, of which a few tell as much as all.
    const int most_rows = is_some ? 2 : 128, every = 1 + whole.height / most_rows;
    for (int y = is_some ? every / 2 : 0; y < whole.height; y += every) {
        const HostDepth row = part_of(whole, 0, y, whole.width, 1);
        changes.add(row);
        numbers.add(row);
    }
    if (is_some)
        for (int y = 0; y < whole.height; y += std::max(1, whole.height / 24))
            numbers.add_some(part_of(whole, 0, y, whole.width, 1), std::max(1, whole.width / 240));
}

void Subject::take_sample(int columns, int rows) {
    const int across = std::max(1, whole.width / columns), down = std::max(1, whole.height / rows);
    for (int y = down / 2; y < whole.height; y += down)
        for (int x = across / 2; x < whole.width; x += across) {
            const HostDepth pixel = part_of(whole, x, y, 1, 1);
            const auto* first = static_cast<const std::byte*>(pixel.data);
            sample_.insert(sample_.end(), first, first + pixel_bytes(storage));
            visit_values(pixel, [&](float value, std::uint32_t bits) { depths_.push_back(depth(x, y, value, bits)); });
        }
}

HostDepth Subject::values() const {
    return sample_.empty() ? whole
                           : HostDepth{sample_.data(), static_cast<int>(depths_.size()), 1, sample_.size(), storage};
}

HostFloats Subject::z() const {
    return sample_.empty() ? given_ : HostFloats{depths_.data(), static_cast<int>(depths_.size()), 1};
}

float Subject::depth(int x, int y, float value, std::uint32_t bits) const {
    if (given_.data)
        return row_of(given_, y)[static_cast<std::size_t>(x)];
    constexpr float invalid = std::numeric_limits<float>::quiet_NaN();
    const StoredKind kind = kind_of(form_, value, bits);
    if (kind == StoredKind::background)
        return std::numeric_limits<float>::infinity();
    if (kind == StoredKind::missing || !(value >= form_.lowest && value <= form_.highest))
        return invalid;
    if (std::isinf(value) && (form_.form == Form::affine || form_.form == Form::ray_distance))
        return form_.farther * value > 0 ? form_.farther * value : invalid; // sums of it would be NaN
    const auto v = static_cast<double>(value);
    const auto sum = [&](const std::array<double, 4>& row) {
        return row[0] * v + row[1] * (x + 0.5) + row[2] * (y + 0.5) + row[3];
    };
    const bool is_quotient =
        form_.form != Form::exponential && !is_along_ray(form_); // which needs no long doubles here
    const auto z = static_cast<float>(is_quotient ? sum(numerator_) / sum(denominator_)
                                                  : static_cast<double>(view_depth(form_, rays_, x + 0.5, y + 0.5, v)));
    return z > form_.least_depth ? z : invalid;
}

} // namespace fathom
