#pragma once

#include <cstddef>
#include <functional>
#include <string_view>
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

/// Rows [begin, end) of an image, of which each reads a number of rows of its own above and below it.
struct ReachingRows {
    int begin, end;
    int height;               ///< of the image
    std::vector<int> reaches; ///< of rows `begin` to `end`
};

/// The highest bands whose `bytes(read, made)` are at most `budget`, all of one height but the last. They are at least 64 rows
/// high, and an eighth of the rows that they read around them: lower ones would read most rows again and again. Pure: no device.
/// Throws: Error that names `what` and the smallest budget that is enough for such bands.
std::vector<Band> bands_within(const ReachingRows& rows, const std::function<std::size_t(int read, int made)>& bytes,
                               std::size_t budget, std::string_view what);

/// Throws: Error that `what` needs so many bytes, of a budget of fewer.
[[noreturn]] void refuse_budget(std::string_view what, std::size_t needed, std::size_t budget);

} // namespace fathom
