#include "float_bytes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace fathom::io {
namespace {

/// Places among B, G, R and A of the bytes of a number, from the lowest on: R, G, B, A and B, G, R, A in both byte orders.
constexpr std::array<std::array<int, 4>, 4> places{{{2, 1, 0, 3}, {3, 0, 1, 2}, {0, 1, 2, 3}, {3, 2, 1, 0}}};

std::uint32_t bits_of(const cv::Vec4b& bytes, const std::array<int, 4>& place) {
    std::uint32_t bits = 0;
    for (int i = 0; i < 4; ++i)
        bits |= std::uint32_t{bytes[place[static_cast<std::size_t>(i)]]} << (8 * i);
    return bits;
}

bool is_length(float value) {
    return std::abs(value) > 1e-3f && std::abs(value) < 1e6f;
}

/// What is written where nothing is.
bool is_no_length(float value) {
    return !std::isfinite(value) || value == 0 || std::abs(value) >= 1e9f;
}

} // namespace

void FloatBytes::add(const cv::Mat& bgra) {
    constexpr int step = 4;
    std::vector<std::uint32_t> line;
    for (std::size_t i = 0; i < places.size(); ++i) {
        Order& order = orders_[i];
        const auto bits = [&](int x, int y) { return bits_of(bgra.at<cv::Vec4b>(y, x), places[i]); };
        const auto add_bends = [&] {
            for (std::uint32_t& each : line)
                each &= 0x7fffffff;
            order.bends.add(line, 23);
            line.clear();
        };
        for (int y = 0; y < bgra.rows; y += step) {
            float before = std::nanf("");
            for (int x = 0; x < bgra.cols; ++x) {
                line.push_back(bits(x, y));
                const auto value = std::bit_cast<float>(line.back());
                if (is_length(value)) {
                    if (x % step == 0) {
                        order.lengths.push_back(line.back() & 0x7fffffff);
                        order.negative += value < 0;
                    }
                    if (is_length(before)) {
                        ++order.pairs;
                        order.smooth += std::abs(value - before) <= 0.05f * std::abs(value);
                    }
                } else if (x % step == 0)
                    order.others += !is_no_length(value);
                before = value;
            }
            add_bends();
        }
        for (int x = 0; x < bgra.cols; x += step) {
            for (int y = 0; y < bgra.rows; ++y)
                line.push_back(bits(x, y));
            add_bends();
        }
    }
    seen_ += static_cast<std::size_t>((bgra.rows + step - 1) / step) *
             static_cast<std::size_t>((bgra.cols + step - 1) / step);
}

bool FloatBytes::Order::is_of_floats(std::size_t seen) const {
    const std::size_t count = lengths.size();
    constexpr std::size_t least = 16;
    if (count < least || 20 * count < seen || 50 * others > count || // but for a few that are wrong
        (50 * negative > count && 50 * (count - negative) > count) || 10 * smooth < 7 * pairs)
        return false;
    std::vector<std::uint32_t> sorted = lengths;
    const auto quantile = [&](std::size_t rank) {
        std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(rank));
        return sorted[rank];
    };
    const std::uint32_t low = quantile(count / 100), high = quantile(count - 1 - count / 100);
    // Lengths of one scene, which would be nearly one fraction, unless it rises alike below and above powers of two.
    return std::bit_cast<float>(high) > 1.25f * std::bit_cast<float>(low) &&
           static_cast<double>(high) < 1.1 * static_cast<double>(low) &&
           (bends.of_numbers < 4 || bends.of_numbers <= 2 * bends.of_floats);
}

bool FloatBytes::are_floats() const {
    return std::ranges::any_of(orders_, [&](const Order& order) { return order.is_of_floats(seen_); });
}

} // namespace fathom::io
