// Stored depth whose near surfaces are larger, on the host:
//   z'(x) = min z over the pixels whose centres are at most N pixels away
// A pixel takes the stored value of the nearest surface, not its distance, so that values keep their bits.

#include <fathom/linearize.hpp>

#include "description/check.hpp"
#include "description/lens.hpp"
#include "operations/moved_values.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace fathom {

void grow_foreground(const StoredDepth& stored, const Image& result, int pixels) {
    check_stored(stored);
    description::Check{}("pixels", pixels, description::grown_pixels);
    MovedValues image(stored, result);
    const int width = image.width, height = image.height;
    for (int y = 0; y < height; ++y) {
        std::vector<float> nearest(image.z.begin() + static_cast<std::ptrdiff_t>(image.at(0, y)),
                                   image.z.begin() + static_cast<std::ptrdiff_t>(image.at(0, y + 1)));
        for (int dy = std::max(-pixels, -y); dy <= std::min(pixels, height - 1 - y); ++dy) {
            const int aside = static_cast<int>(std::sqrt(pixels * pixels - dy * dy));
            for (int dx = -aside; dx <= aside; ++dx) {
                for (int x = std::max(0, -dx); x < std::min(width, width - dx); ++x) {
                    const float other = image.z[image.at(x + dx, y + dy)];
                    if (!(other < nearest[static_cast<std::size_t>(x)]))
                        continue;
                    nearest[static_cast<std::size_t>(x)] = other;
                    image.take(image.at(x, y), image.values, image.at(x + dx, y + dy));
                }
            }
        }
    }
    image.write(result);
}

StoredDepth grow_foreground(const StoredDepth& stored, int pixels) {
    return with_moved_values(stored, [&](const Image& result) { grow_foreground(stored, result, pixels); });
}

} // namespace fathom
