#pragma once

#include "require.hpp"

#include <fathom/camera_file.hpp>
#include <fathom/findings.hpp>

#include <Eigen/Core>

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <locale>
#include <sstream>
#include <string>

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

inline std::size_t pixel_bytes(Storage storage) {
    static constexpr std::size_t bytes[] = {4, 2, 1, 2, 4, 4, 3, 3, 3, 3}; // in the order of Storage
    return bytes[static_cast<std::size_t>(storage)];
}

/// What such a packed code of 16 bits holds.
inline std::uint16_t unpacked_code(std::uint16_t code, Packing packing) {
    return packing == Packing::uint16_rotated   ? std::rotr(code, 3)
           : packing == Packing::uint16_swapped ? std::rotr(code, 8)
           : packing == Packing::uint13         ? static_cast<std::uint16_t>(code & 0x1fff)
                                                : code;
}

/// A fraction before it went through a curve: that of sRGB, or the inverse of a power.
inline double linear_of(double value, double gamma) {
    if (gamma != gamma_of_srgb)
        return std::pow(value, gamma);
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// A number in a sentence, with at most so many digits.
inline std::string number(double value, int digits = 7) {
    std::ostringstream stream;
    stream.imbue(std::locale::classic());
    stream.precision(digits);
    stream << value;
    return stream.str();
}

/// As visit_values gives them.
inline std::uint32_t bits_of_value(float value, Storage storage) {
    return storage == Storage::float32 ? std::bit_cast<std::uint32_t>(value)
           : storage == Storage::float16
               ? std::uint32_t{Eigen::numext::bit_cast<std::uint16_t>(static_cast<Eigen::half>(value))}
               : static_cast<std::uint32_t>(value);
}

/// Some pixels of an image.
inline HostDepth part_of(const HostDepth& stored, int x, int y, int width, int height) {
    return {static_cast<const unsigned char*>(stored.data) + static_cast<std::size_t>(y) * stored.row_bytes +
                static_cast<std::size_t>(x) * pixel_bytes(stored.storage),
            width, height, stored.row_bytes, stored.storage};
}

/// Throws: std::invalid_argument for stored depth of another size than the camera's.
inline void check_size(const Camera& camera, const HostDepth& stored) {
    require(camera.width == stored.width && camera.height == stored.height, "stored depth of ",
            ImageSize{stored.width, stored.height}, " pixels; must be of the camera's ",
            ImageSize{camera.width, camera.height});
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
