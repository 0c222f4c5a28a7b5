#pragma once

#include <cstddef>
#include <vector>

namespace fathom {

/// Rows that a pass makes, [begin, end), and those that it reads for that, [first, last).
struct Band {
    int begin, end, first, last;
};

/// Divides rows into bands. What a band reads takes at most `budget` bytes, unless one row and its halo alone take more.
/// Bands do not overlap in what they make, and together make every row. Pure: no device.
std::vector<Band> bands(int rows, int halo, std::size_t row_bytes, std::size_t budget);

} // namespace fathom
