#pragma once

#include <fathom/device.hpp>

#include <cstddef>
#include <functional>
#include <limits>
#include <string_view>
#include <vector>

namespace fathom {

/// Rows that a pass makes, [begin, end), and those that it reads for that, [first, last).
struct Band {
    int begin, end, first, last;
};

/// Rows [begin, end) of an image that are to be made: what each reads around it, and what a band of them takes. A row may stand
/// for several rows of pixels.
struct RowNeeds {
    int begin, end;
    int height;                                           ///< of the image
    std::vector<int> reaches;                             ///< rows above and below each row; one number stands for all
    std::function<std::size_t(int read, int made)> bytes; ///< of a band
    int least = 1;                                        ///< that a band has, at least
};

/// Divides rows into bands, all of one height but the last: the highest ones, to a tenth, of which each takes at most `budget`
/// bytes. They have at least `least` rows, and an eighth of the rows that they read around them: lower ones would read most rows
/// again and again. Bands do not overlap in what they make, and together make every row. Pure: no device.
///
/// Where even the lowest take more, these are returned, unless there is a name for what needs them.
/// Throws: Error that names `what` and the smallest budget that is enough.
std::vector<Band> bands(const RowNeeds& rows, std::size_t budget, std::string_view what = {});

/// The most rows that any of the bands reads, and the most that one makes.
int most_read(const std::vector<Band>& all);
int most_made(const std::vector<Band>& all);

/// More than any memory has.
inline constexpr std::size_t no_budget = std::numeric_limits<std::ptrdiff_t>::max();

/// The device's memory budget, or `no_budget`.
std::size_t budget_of(const Device& device);

/// Throws: Error that `what` needs so many bytes, and the budget is smaller.
[[noreturn]] void refuse_budget(std::string_view what, std::size_t needed);

} // namespace fathom
