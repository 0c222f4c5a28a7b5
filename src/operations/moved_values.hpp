#pragma once

#include "operations/parameters.hpp"
#include "runtime/scratch.hpp"

#include <fathom/linearize.hpp>

#include <cstring>
#include <vector>

namespace fathom {

/// The pixels of stored depth on the host, and their view depths: for what gives a pixel the stored value of another one, which keeps
/// its bits.
struct MovedValues {
    const Image& image;
    int width = image.width(), height = image.height();
    Layout layout{width, height, image.channels()};
    std::size_t pixel = element_bytes(image.element()) * static_cast<std::size_t>(image.channels());
    std::vector<float> z;
    std::vector<std::byte> values, moved; ///< as they are stored, and as they will be

    /// Throws: as `check_result`, for an image that cannot take the result.
    MovedValues(const StoredDepth& stored, const Image& result)
        : image(stored.image), z(at(0, height)), values(at(0, height) * pixel) {
        check_result(stored, {"the result", result}, image.element(), layout);
        image.download(values.data());
        linearize(stored).image.download(z.data());
        moved = values;
    }

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }

    /// Gives a pixel another one's value, from `values` or from `moved` itself.
    void take(std::size_t to, const std::vector<std::byte>& from, std::size_t other) {
        std::memcpy(&moved[to * pixel], &from[other * pixel], pixel);
    }

    /// Waits for the device.
    void write(const Image& result) const {
        const Device& device = image.device();
        runtime::copy(Image::from_host(device, image.element(), moved.data(), layout), result);
        device.finish();
    }
};

/// The same stored depth with an image of its own, which `make` fills.
StoredDepth with_moved_values(const StoredDepth& stored, const auto& make) {
    check_stored(stored);
    StoredDepth made = stored;
    made.image = Image(stored.image.device(), stored.image.element(),
                       {stored.image.width(), stored.image.height(), stored.image.channels()});
    make(made.image);
    return made;
}

} // namespace fathom
