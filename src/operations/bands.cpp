// Rows in bands, so that what lies between the passes of an operation does not grow with the image.

#include "operations/bands.hpp"

#include <algorithm>

namespace fathom {

std::vector<Band> bands(int rows, int halo, RowBytes row, std::size_t budget, int least) {
    const std::size_t whole = row.read + row.made, in_halo = 2 * static_cast<std::size_t>(halo) * row.read;
    const std::size_t fit = budget / whole >= static_cast<std::size_t>(rows) ? static_cast<std::size_t>(rows)
                            : budget > in_halo                               ? (budget - in_halo) / whole
                                                                             : 0;
    const int highest = std::clamp(static_cast<int>(fit), std::min(least, rows), rows);
    const int count = (rows + highest - 1) / highest, height = (rows + count - 1) / count;
    std::vector<Band> all;
    for (int begin = 0; begin < rows; begin += height) {
        const int end = std::min(begin + height, rows);
        all.push_back({begin, end, std::max(begin - halo, 0), std::min(end + halo, rows)});
    }
    return all;
}

} // namespace fathom
