// Rows in bands, so that what lies between the passes of an operation does not grow with the image.

#include "operations/bands.hpp"

#include <algorithm>

namespace fathom {

std::vector<Band> bands(int rows, int halo, std::size_t row_bytes, std::size_t budget) {
    const std::size_t reads =
        std::min(budget / row_bytes, static_cast<std::size_t>(rows) + 2 * static_cast<std::size_t>(halo));
    const int height = std::max(static_cast<int>(reads) - 2 * halo, 1);
    std::vector<Band> all;
    for (int begin = 0; begin < rows; begin += height) {
        const int end = std::min(begin + height, rows);
        all.push_back({begin, end, std::max(begin - halo, 0), std::min(end + halo, rows)});
    }
    return all;
}

} // namespace fathom
