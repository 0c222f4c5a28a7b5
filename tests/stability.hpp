#pragma once

// Small images through the device, for tests of what happens at the edges.

#include "camera_over.hpp"
#include "judge.hpp"

#include <fathom/fathom.hpp>

#include <cstddef>
#include <limits>
#include <vector>

namespace fathom::stability {

inline constexpr float infinity = std::numeric_limits<float>::infinity();
inline constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

inline Camera camera_of(const Projection& projection, int width = 64, int height = 64) {
    return camera_over(projection, width, height);
}

/// Decodes stored values as one row of a camera that is as wide, at the camera's own top left.
template <typename Value>
std::vector<float> decoded(Camera camera, const std::vector<Value>& values, Storage storage = Storage::float32,
                           Background background = Background::inf, Arithmetic arithmetic = oracle::widest()) {
    camera.width = static_cast<int>(values.size());
    camera.height = 1;
    std::vector<float> depth(values.size());
    const Device& device = oracle::device(arithmetic);
    const Image stored =
        Image::from_host(device, element_of(storage), values.data(), {camera.width, 1, channels_of(storage)});
    const Image result = Image::onto_host(device, Element::f32, depth.data(), {camera.width, 1});
    linearize({stored, camera, storage}, result, {background});
    result.download(depth.data());
    return depth;
}

} // namespace fathom::stability
