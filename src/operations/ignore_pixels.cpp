// Pixels that do not count, on the host.

#include <fathom/linearize.hpp>

#include "operations/invalid_value.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/scratch.hpp"

#include <cstring>
#include <vector>

namespace fathom {
namespace {

std::vector<std::byte> pixels_of(const Image& image) {
    std::vector<std::byte> bytes(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) *
                                 static_cast<std::size_t>(image.channels()) * element_bytes(image.element()));
    image.download(bytes.data());
    return bytes;
}

// A float of either sign of 0 is 0, and all that remains of an integer is whether it has a bit.
bool is_zero(Element element, const std::byte* value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, value, element_bytes(element));
    const std::uint32_t sign = element == Element::f32 ? 0x80000000 : element == Element::f16 ? 0x8000 : 0;
    return (bits & ~sign) == 0;
}

} // namespace

StoredDepth ignore_pixels(const StoredDepth& stored, const Image& ignore) {
    check_stored(stored);
    const Image& image = stored.image;
    const int width = image.width(), height = image.height();
    require(static_cast<bool>(ignore) && ignore.width() == width && ignore.height() == height && ignore.channels() == 1,
            "ignore must have one number for each of the depth's ", width, " x ", height, " pixels");
    std::vector<std::byte> values = pixels_of(image);
    const std::vector<std::byte> mask = pixels_of(ignore);
    const HostDepth on_host{values.data(), width, height, values.size() / static_cast<std::size_t>(height),
                            stored.storage};
    StoredDepth made = stored;
    InvalidValue invalid(stored.camera, stored.storage);
    invalid.see(on_host);
    invalid.settle(made.camera);
    invalid.write(values.data(), on_host, [&](int x, int y) {
        const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
        return !is_zero(ignore.element(), &mask[at * element_bytes(ignore.element())]);
    });
    const Device& device = image.device();
    const Layout layout{width, height, image.channels()};
    made.image = Image(device, image.element(), layout);
    runtime::copy(Image::from_host(device, image.element(), values.data(), layout), made.image);
    device.finish(); // `values` end here
    return made;
}

} // namespace fathom
