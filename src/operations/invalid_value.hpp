#pragma once

#include "camera/form.hpp"
#include "doubts/stored_values.hpp"

#include <fathom/camera.hpp>
#include <fathom/error.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

namespace fathom {

/// The stored value of a pixel that does not count: NaN of floats, and otherwise what the camera calls `missing`. Where it names no
/// such code, it is the largest one that no pixel has, which the camera then names: so that no other pixel changes.
class InvalidValue {
public:
    InvalidValue(const Camera& camera, Storage storage) : storage_(storage) {
        if (storage == Storage::float32) {
            bits_ = 0x7fc00000;
        } else if (storage == Storage::float16) {
            bits_ = 0x7e00;
        } else if (const DepthForm form = depth_form(straightened(camera), storage); form.missing) {
            bits_ = form.missing;
        } else {
            used_.resize(static_cast<std::size_t>(storage_max(storage)) + 1);
            if (form.background)
                used_[*form.background] = true;
        }
    }

    /// Must all stored values be seen before one is written?
    bool is_open() const { return !bits_; }

    void see(const HostDepth& values) {
        if (is_open())
            visit_values(values, [&](float, std::uint32_t bits) { used_[bits] = true; });
    }

    /// The camera under which it is invalid, once all values were seen.
    /// Throws: Error where every code is used.
    void settle(Camera& camera) {
        if (!is_open())
            return;
        const auto unused = std::find(used_.rbegin(), used_.rend(), false);
        if (unused == used_.rend())
            throw Error(std::string("every code of ") + to_string(storage_) +
                        " is used, so that none is left for pixels that do not count; say which one means "
                        "\"not measured\" by \"missing\"");
        bits_ = static_cast<std::uint32_t>(used_.rend() - unused - 1);
        camera.missing = *bits_;
        used_.clear();
    }

    /// Writes it where `ignored(x, y)`, into the pixels that `values` describes.
    template <typename Ignored>
    void write(void* pixels, const HostDepth& values, const Ignored& ignored) const {
        const std::size_t size = pixel_bytes(storage_);
        const std::array<unsigned char, 4> bytes = in_memory();
        for (int y = 0; y < values.height; ++y) {
            auto* pixel = static_cast<unsigned char*>(pixels) + static_cast<std::size_t>(y) * values.row_bytes;
            for (int x = 0; x < values.width; ++x, pixel += size)
                if (ignored(x, y))
                    std::memcpy(pixel, bytes.data(), size);
        }
    }

private:
    std::array<unsigned char, 4> in_memory() const {
        std::uint32_t bits = *bits_;
        if (storage_ == Storage::uint24_high)
            bits <<= 8;
        if (storage_ == Storage::rgb8_red_high || storage_ == Storage::bgr8_red_low)
            bits = (bits & 0xff) << 16 | (bits & 0xff00) | bits >> 16;
        return std::bit_cast<std::array<unsigned char, 4>>(bits); // memory is little-endian
    }

    Storage storage_;
    std::optional<std::uint32_t> bits_;
    std::vector<bool> used_; // codes
};

} // namespace fathom
