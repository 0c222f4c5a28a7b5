// Kernels ahead of time: a call is run on depth that is made up, so that nothing is left to build for the first real one.

#include "require.hpp"
#include "runtime/launched.hpp"

#include <fathom/image.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

namespace fathom {
namespace {

// A stored value for t from 0 to 1: over the range that the form has, or over all lengths that scenes have.
float stored_value(const DepthForm& form, float t) {
    constexpr float widest = 1e6f;
    const float span = form.highest - form.lowest;
    return span < widest ? form.lowest + t * span : std::clamp(std::exp2(30 * t - 10), form.lowest, form.highest);
}

// The bits of one element, least significant byte first.
std::uint32_t code(const DepthForm& form, Storage storage, float t) {
    const auto integer = [&](int bits) { return static_cast<std::uint32_t>(t * static_cast<float>((1 << bits) - 1)); };
    switch (storage) {
    case Storage::float32:
        return std::bit_cast<std::uint32_t>(stored_value(form, t));
    case Storage::float16:
        return std::bit_cast<std::uint16_t>(Eigen::half(stored_value(form, t)));
    case Storage::uint8:
        return integer(8);
    case Storage::uint16:
        return integer(16);
    case Storage::uint24_high:
        return integer(24) << 8;
    default:
        return integer(24);
    }
}

std::vector<unsigned char> every_value(const DepthForm& form, Storage storage, std::size_t pixels) {
    const std::size_t size = element_bytes(element_of(storage)) * static_cast<std::size_t>(channels_of(storage));
    std::vector<unsigned char> bytes(pixels * size);
    for (std::size_t i = 0; i < pixels; ++i) {
        const std::uint32_t bits = code(form, storage, static_cast<float>(i) / static_cast<float>(pixels));
        std::memcpy(bytes.data() + i * size, &bits, size); // the low bytes: memory is little-endian
    }
    return bytes;
}

} // namespace

void Device::prepare(const Camera& camera, Storage storage, const std::function<void(const StoredDepth&)>& call) const {
    require(camera.width > 0 && camera.height > 0,
            text("prepare needs the size of the images: the camera has ", camera.width, " x ", camera.height));
    const std::vector<unsigned char> values =
        every_value(depth_form(camera, storage), storage,
                    static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
    const runtime::Launched guard(*this); // an exception leaves no kernel that reads the values
    call({Image::from_host(*this, element_of(storage), values.data(),
                           {camera.width, camera.height, channels_of(storage)}),
          camera, storage});
    finish();
}

} // namespace fathom
