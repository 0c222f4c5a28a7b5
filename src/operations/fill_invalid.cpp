// Stored depth without holes, on the host.

#include <fathom/linearize.hpp>

#include "operations/parameters.hpp"
#include "runtime/scratch.hpp"

#include <cmath>
#include <cstring>
#include <vector>

namespace fathom {
namespace {

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
    const Image& image = stored.image;
    const int width = image.width(), height = image.height();
    check_result(stored, {"the result", result}, image.element(), {width, height, image.channels()});
    const std::size_t pixel = element_bytes(image.element()) * static_cast<std::size_t>(image.channels());
    const auto at = [&](int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    };
    std::vector<std::byte> values(at(0, height) * pixel);
    std::vector<float> z(at(0, height));
    image.download(values.data());
    linearize(stored).image.download(z.data());
    std::vector<std::byte> filled = values;
    for (int y = 0; y < height; ++y) {
        const std::vector<float> row(z.begin() + static_cast<std::ptrdiff_t>(at(0, y)),
                                     z.begin() + static_cast<std::ptrdiff_t>(at(0, y + 1)));
        farther_sides(
            width, [&](int x) { return row[static_cast<std::size_t>(x)]; },
            [&](int x, int from) {
                if (from == none)
                    return;
                std::memcpy(&filled[at(x, y) * pixel], &values[at(from, y) * pixel], pixel);
                z[at(x, y)] = row[static_cast<std::size_t>(from)];
            });
    }
    for (int x = 0; x < width; ++x)
        farther_sides(
            height, [&](int y) { return z[at(x, y)]; },
            [&](int y, int from) {
                if (from != none && from != y)
                    std::memcpy(&filled[at(x, y) * pixel], &filled[at(x, from) * pixel], pixel);
            });
    const Device& device = image.device();
    runtime::copy(Image::from_host(device, image.element(), filled.data(), {width, height, image.channels()}), result);
    device.finish(); // `filled` ends here
}

StoredDepth fill_invalid(const StoredDepth& stored) {
    check_stored(stored);
    StoredDepth filled = stored;
    filled.image = Image(stored.image.device(), stored.image.element(),
                         {stored.image.width(), stored.image.height(), stored.image.channels()});
    fill_invalid(stored, filled.image);
    return filled;
}

} // namespace fathom
