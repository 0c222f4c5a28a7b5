#pragma once

#include <fathom/findings.hpp>

#include <Eigen/Core>

#include <bit>
#include <cstddef>
#include <cstdint>

namespace fathom {

template <typename Element, typename Visit>
void visit_pixels(const HostDepth& stored, int channels, const Visit& visit) {
    for (int y = 0; y < stored.height; ++y) {
        const auto* row =
            static_cast<const unsigned char*>(stored.data) + static_cast<std::size_t>(y) * stored.row_bytes;
        const auto* pixel = reinterpret_cast<const Element*>(row);
        for (int x = 0; x < stored.width; ++x, pixel += channels)
            visit(pixel);
    }
}

/// The stored values as numbers, row by row, and their bits, which are compared with the background's.
template <typename Visit>
void visit_values(const HostDepth& stored, const Visit& visit) {
    const auto code = [&](std::uint32_t value) { visit(static_cast<float>(value), value); };
    const auto bytes = [&](int lowest, int highest) {
        visit_pixels<std::uint8_t>(stored, 3, [&](const std::uint8_t* b) {
            code(std::uint32_t{b[lowest]} | std::uint32_t{b[1]} << 8 | std::uint32_t{b[highest]} << 16);
        });
    };
    switch (stored.storage) {
    case Storage::float32:
        visit_pixels<float>(stored, 1, [&](const float* v) { visit(*v, std::bit_cast<std::uint32_t>(*v)); });
        break;
    case Storage::float16:
        visit_pixels<Eigen::half>(stored, 1, [&](const Eigen::half* v) {
            visit(static_cast<float>(*v), std::uint32_t{Eigen::numext::bit_cast<std::uint16_t>(*v)});
        });
        break;
    case Storage::uint8:
        visit_pixels<std::uint8_t>(stored, 1, [&](const std::uint8_t* v) { code(*v); });
        break;
    case Storage::uint16:
        visit_pixels<std::uint16_t>(stored, 1, [&](const std::uint16_t* v) { code(*v); });
        break;
    case Storage::uint24:
        visit_pixels<std::uint32_t>(stored, 1, [&](const std::uint32_t* v) { code(*v & 0xffffff); });
        break;
    case Storage::uint24_high:
        visit_pixels<std::uint32_t>(stored, 1, [&](const std::uint32_t* v) { code(*v >> 8); });
        break;
    case Storage::rgb8_red_low:
    case Storage::bgr8_red_high:
        bytes(0, 2);
        break;
    case Storage::rgb8_red_high:
    case Storage::bgr8_red_low:
        bytes(2, 0);
        break;
    }
}

} // namespace fathom
