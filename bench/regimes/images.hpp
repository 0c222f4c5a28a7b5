#pragma once

// Small images through the device.

#include "camera_over.hpp"

#include <fathom/fathom.hpp>

#include <cstddef>
#include <vector>

namespace fathom::regimes {

/// On a CPU device the values themselves: they have to stay.
template <typename Value>
StoredDepth stored_of(const Device& device, const std::vector<Value>& values, const Camera& camera,
                      Storage storage = Storage::float32) {
    return {Image::from_host(device, element_of(storage), values.data(),
                             {camera.width, camera.height, channels_of(storage)}),
            camera, storage};
}

inline std::vector<float> floats_of(const Image& image) {
    std::vector<float> values(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) *
                              static_cast<std::size_t>(image.channels()));
    image.download(values.data());
    return values;
}

} // namespace fathom::regimes
