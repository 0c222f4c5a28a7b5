// Stored depth whose near surfaces are larger, on the host:
//   z'(x) = min z over the pixels whose centres are at most N pixels away
// A pixel takes the stored value of the nearest surface, not its distance, so that values keep their bits.

#include <fathom/linearize.hpp>

#include "description/range.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/scratch.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace fathom {

void grow_foreground(const StoredDepth& stored, const Image& result, int pixels) {
    check_stored(stored);
    constexpr description::Range range = description::whole(0, most_grown_pixels);
    require(range.holds(pixels), "grow_foreground by ", pixels, " pixels: must be ", range.in_words());
    const Image& image = stored.image;
    const int width = image.width(), height = image.height();
    const Layout layout{width, height, image.channels()};
    check_result(stored, {"the result", result}, image.element(), layout);
    const auto at = [&](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    };
    const std::size_t pixel = element_bytes(image.element()) * static_cast<std::size_t>(image.channels());
    std::vector<std::byte> values(at(0, height) * pixel);
    std::vector<float> z(at(0, height));
    image.download(values.data());
    linearize(stored).image.download(z.data());
    std::vector<std::byte> grown = values;
    for (int y = 0; y < height; ++y) {
        std::vector<float> nearest(z.begin() + static_cast<std::ptrdiff_t>(at(0, y)),
                                   z.begin() + static_cast<std::ptrdiff_t>(at(0, y + 1)));
        for (int dy = std::max(-pixels, -y); dy <= std::min(pixels, height - 1 - y); ++dy) {
            const int aside = static_cast<int>(std::sqrt(pixels * pixels - dy * dy));
            for (int dx = -aside; dx <= aside; ++dx) {
                for (int x = std::max(0, -dx); x < std::min(width, width - dx); ++x) {
                    const float other = z[at(x + dx, y + dy)];
                    if (!(other < nearest[static_cast<std::size_t>(x)]))
                        continue;
                    nearest[static_cast<std::size_t>(x)] = other;
                    std::memcpy(&grown[at(x, y) * pixel], &values[at(x + dx, y + dy) * pixel], pixel);
                }
            }
        }
    }
    const Device& device = image.device();
    runtime::copy(Image::from_host(device, image.element(), grown.data(), layout), result);
    device.finish(); // `grown` ends here
}

StoredDepth grow_foreground(const StoredDepth& stored, int pixels) {
    check_stored(stored);
    StoredDepth grown = stored;
    grown.image = Image(stored.image.device(), stored.image.element(),
                        {stored.image.width(), stored.image.height(), stored.image.channels()});
    grow_foreground(stored, grown.image, pixels);
    return grown;
}

} // namespace fathom
