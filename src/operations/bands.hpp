#pragma once

#include <cstddef>
#include <vector>

namespace fathom {

/// Rows that a pass makes, [begin, end), and those that it reads for that, [first, last).
struct Band {
    int begin, end, first, last;
};

/// The bytes that a row takes where it is read, and those that it takes besides where it is made.
struct RowBytes {
    std::size_t read, made = 0;
};

/// Divides rows into bands, all of one height but the last. What a band reads and makes takes at most `budget` bytes, unless
/// `least` rows and their halo alone take more. Bands do not overlap in what they make, and together make every row. Pure: no
/// device.
std::vector<Band> bands(int rows, int halo, RowBytes row, std::size_t budget, int least = 1);

} // namespace fathom
