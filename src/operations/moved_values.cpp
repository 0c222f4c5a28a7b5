// Stored depth on the host in which pixels have other stored values: those of others, so that there are no holes or that near surfaces
// are larger, or none, so that they do not count.

#include <fathom/linearize.hpp>

#include "description/check.hpp"
#include "description/lens.hpp"
#include "operations/invalid_value.hpp"
#include "operations/parameters.hpp"
#include "require.hpp"
#include "runtime/scratch.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace fathom {
namespace {

// An image of its own for stored depth of the same size and type.
StoredDepth with_own_image(const StoredDepth& stored) {
    check_stored(stored);
    StoredDepth made = stored;
    made.image = Image(stored.image.device(), stored.image.element(),
                       {stored.image.width(), stored.image.height(), stored.image.channels()});
    return made;
}

// The pixels of stored depth on the host, and their view depths: for what gives a pixel the stored value of another one, which keeps
// its bits.
struct MovedValues {
    const Image& image;
    int width = image.width(), height = image.height();
    Layout layout{width, height, image.channels()};
    std::size_t pixel = element_bytes(image.element()) * static_cast<std::size_t>(image.channels());
    std::vector<float> z;
    std::vector<std::byte> values, moved; // as they are stored, and as they will be

    // Throws: as `check_result`, for an image that cannot take the result.
    MovedValues(const StoredDepth& stored, const Image& result) : image(stored.image) {
        check_result(stored, {"the result", result}, image.element(), layout);
        values = runtime::on_host<std::byte>(image);
        z = runtime::on_host<float>(linearize(stored).image);
        moved = values;
    }

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }

    // Gives a pixel another one's value, from `values` or from `moved` itself.
    void take(std::size_t to, const std::vector<std::byte>& from, std::size_t other) {
        std::memcpy(&moved[to * pixel], &from[other * pixel], pixel);
    }
};

constexpr int none = -1;

// The place of the nearest valid pixel before and behind each of a line, the farther of the two; none if there is none.
void farther_sides(int count, const auto& z_at, const auto& take) {
    std::vector<int> before(static_cast<std::size_t>(count));
    for (int i = 0, last = none; i < count; ++i) {
        last = std::isnan(z_at(i)) ? last : i;
        before[static_cast<std::size_t>(i)] = last;
    }
    for (int i = count - 1, behind = none; i >= 0; --i) {
        behind = std::isnan(z_at(i)) ? behind : i;
        const int other = before[static_cast<std::size_t>(i)];
        const bool take_other = other != none && (behind == none || z_at(other) >= z_at(behind));
        take(i, take_other ? other : behind);
    }
}

} // namespace

void fill_invalid(const StoredDepth& stored, const Image& result) {
    check_stored(stored);
    MovedValues pixels(stored, result);
    for (int y = 0; y < pixels.height; ++y) {
        const std::vector<float> row(pixels.z.begin() + static_cast<std::ptrdiff_t>(pixels.at(0, y)),
                                     pixels.z.begin() + static_cast<std::ptrdiff_t>(pixels.at(0, y + 1)));
        farther_sides(
            pixels.width, [&](int x) { return row[static_cast<std::size_t>(x)]; },
            [&](int x, int from) {
                if (from == none)
                    return;
                pixels.take(pixels.at(x, y), pixels.values, pixels.at(from, y));
                pixels.z[pixels.at(x, y)] = row[static_cast<std::size_t>(from)];
            });
    }
    for (int x = 0; x < pixels.width; ++x)
        farther_sides(
            pixels.height, [&](int y) { return pixels.z[pixels.at(x, y)]; },
            [&](int y, int from) {
                if (from != none && from != y)
                    pixels.take(pixels.at(x, y), pixels.moved, pixels.at(x, from));
            });
    runtime::copy_from_host(pixels.moved.data(), result);
}

StoredDepth fill_invalid(const StoredDepth& stored) {
    const StoredDepth made = with_own_image(stored);
    fill_invalid(stored, made.image);
    return made;
}

// Near surfaces become larger:
//   z'(x) = min z over the pixels whose centres are at most N pixels away
// A pixel takes the stored value of the nearest surface, not its distance, so that values keep their bits.

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
    runtime::copy_from_host(image.moved.data(), result);
}

StoredDepth grow_foreground(const StoredDepth& stored, int pixels) {
    const StoredDepth made = with_own_image(stored);
    grow_foreground(stored, made.image, pixels);
    return made;
}

StoredDepth ignore_pixels(const StoredDepth& stored, const Image& ignore) {
    StoredDepth made = with_own_image(stored);
    const Image& image = stored.image;
    const int width = image.width(), height = image.height();
    require(static_cast<bool>(ignore) && ignore.width() == width && ignore.height() == height && ignore.channels() == 1,
            "ignore must have one number for each of the depth's ", width, " x ", height, " pixels");
    std::vector<std::byte> values = runtime::on_host<std::byte>(image);
    const std::vector<float> mask = runtime::floats_of(ignore);
    const HostDepth on_host{values.data(), width, height, values.size() / static_cast<std::size_t>(height),
                            stored.storage};
    InvalidValue invalid(stored.camera, stored.storage);
    invalid.see(on_host);
    invalid.settle(made.camera);
    invalid.write(values.data(), on_host, [&](int x, int y) {
        return mask[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] != 0;
    });
    runtime::copy_from_host(values.data(), made.image);
    return made;
}

} // namespace fathom
