// Kernels ahead of time: a call is run on depth that is made up, so that nothing is left to build for the first real one.

#include "camera/form.hpp"
#include "require.hpp"
#include "runtime/launch.hpp"

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
    const bool backwards = form.numerator[0] < 0 || form.highest <= 0;
    return span < widest
               ? form.lowest + t * span
               : std::clamp(std::copysign(std::exp2(30 * t - 10), backwards ? -1.0f : 1.0f), form.lowest, form.highest);
}

// The bits of one element, least significant byte first.
std::uint32_t code(const DepthForm& form, Storage storage, float t) {
    if (storage == Storage::float32)
        return std::bit_cast<std::uint32_t>(stored_value(form, t));
    if (storage == Storage::float16)
        return std::bit_cast<std::uint16_t>(Eigen::half(stored_value(form, t)));
    const auto integer = static_cast<std::uint32_t>(t * static_cast<float>(storage_max(storage)));
    return storage == Storage::uint24_high ? integer << 8 : integer;
}

// Where the pixel is between the least value and the largest: from the top down all of them, and from the middle on with a
// jump after every few columns. `dof` starts other kernels for a depth that lies in few places than for one that is all over.
float fraction(std::size_t x, std::size_t y, std::size_t width, std::size_t height) {
    constexpr std::size_t columns = 40, kinds = 5;
    const std::size_t half = (height + 1) / 2;
    const float down = static_cast<float>((y % half) * width + x) / static_cast<float>(half * width);
    const float jump = y < half ? 0 : static_cast<float>(x / columns % kinds) / kinds;
    return down + jump < 1 ? down + jump : down + jump - 1;
}

std::vector<unsigned char> every_value(const DepthForm& form, Storage storage, std::size_t width, std::size_t height) {
    const std::size_t pixels = width * height;
    const std::size_t size = element_bytes(element_of(storage)) * static_cast<std::size_t>(channels_of(storage));
    std::vector<unsigned char> bytes(pixels * size);
    for (std::size_t i = 0; i < pixels; ++i) {
        const std::uint32_t bits = code(form, storage, fraction(i % width, i / width, width, height));
        std::memcpy(bytes.data() + i * size, &bits, size); // the low bytes: memory is little-endian
    }
    return bytes;
}

} // namespace

void Device::prepare(const Camera& camera, Storage storage, const std::function<void(const StoredDepth&)>& call) const {
    require(camera.width > 0 && camera.height > 0, "prepare needs the size of the images: the camera has ",
            camera.width, " x ", camera.height);
    const std::vector<unsigned char> values =
        every_value(depth_form(straightened(camera), storage), storage, static_cast<std::size_t>(camera.width),
                    static_cast<std::size_t>(camera.height));
    const runtime::Launched guard(*this); // an exception leaves no kernel that reads the values
    call({Image::from_host(*this, element_of(storage), values.data(),
                           {camera.width, camera.height, channels_of(storage)}),
          camera, storage});
    finish();
}

} // namespace fathom
