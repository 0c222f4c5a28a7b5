// Rows in bands, so that what lies between the passes of an operation does not grow with the image.

#include "operations/bands.hpp"

#include "text.hpp"

#include <fathom/error.hpp>

#include <algorithm>
#include <limits>
#include <string>

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

namespace {

std::vector<Band> bands_of(const ReachingRows& rows, int height) {
    std::vector<Band> all;
    for (int begin = rows.begin; begin < rows.end; begin += height) {
        Band band{begin, std::min(begin + height, rows.end), begin, begin};
        for (int row = band.begin; row < band.end; ++row) {
            const int reach = std::min(rows.reaches[static_cast<std::size_t>(row - rows.begin)], rows.height);
            band.first = std::min(band.first, std::max(row - reach, 0));
            band.last = std::max(band.last, std::min(row + reach + 1, rows.height));
        }
        all.push_back(band);
    }
    return all;
}

} // namespace

void refuse_budget(std::string_view what, std::size_t needed, std::size_t budget) {
    constexpr std::size_t mebibyte = std::size_t{1} << 20;
    throw Error(text(what, " needs a memory budget of ", (needed + mebibyte - 1) / mebibyte, " MiB, and has ",
                     budget < mebibyte ? "less than 1" : std::to_string(budget / mebibyte), "; raise it"));
}

std::vector<Band> bands_within(const ReachingRows& rows, const std::function<std::size_t(int read, int made)>& bytes,
                               std::size_t budget, std::string_view what) {
    const int count = rows.end - rows.begin;
    std::size_t fewest = std::numeric_limits<std::size_t>::max();
    for (int height = count;;) {
        const std::vector<Band> all = bands_of(rows, height);
        int read = 0;
        for (const Band& band : all)
            read = std::max(read, band.last - band.first);
        const std::size_t needed = bytes(read, height);
        if (needed <= budget)
            return all;
        fewest = std::min(fewest, needed); // lower bands may take more, as where all passes of ssao share their depth
        const int least = std::min(std::max(64, (read - height) / 8), count);
        if (height <= least)
            refuse_budget(what, fewest, budget);
        const int parts = (count + height - 1) / height, more = std::max(parts + 1, parts * 11 / 10);
        height = std::max((count + more - 1) / more, least);
    }
}

} // namespace fathom
