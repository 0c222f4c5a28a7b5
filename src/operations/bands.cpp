// Rows in bands, so that what lies between the passes of an operation does not grow with the image.

#include "operations/bands.hpp"

#include "text.hpp"

#include <fathom/error.hpp>

#include <algorithm>
#include <limits>

namespace fathom {
namespace {

Band band_of(const RowNeeds& rows, int begin, int end) {
    Band band{begin, end, begin, end};
    const bool alike = rows.reaches.size() == 1; // the first and the last row reach farthest
    for (int row = begin; row < end; row += alike ? std::max(end - 1 - begin, 1) : 1) {
        const int asked = rows.reaches[alike ? 0 : static_cast<std::size_t>(row - rows.begin)],
                  reach = std::min(asked, rows.height);
        band.first = std::min(band.first, std::max(row - reach, 0));
        band.last = std::max(band.last, std::min(row + reach + 1, rows.height));
    }
    return band;
}

std::vector<Band> bands_of(const RowNeeds& rows, int height) {
    std::vector<Band> all;
    for (int begin = rows.begin; begin < rows.end; begin += height)
        all.push_back(band_of(rows, begin, std::min(begin + height, rows.end)));
    return all;
}

} // namespace

std::vector<Band> bands(const RowNeeds& rows, std::size_t budget, std::string_view what) {
    const int count = rows.end - rows.begin;
    std::size_t fewest = std::numeric_limits<std::size_t>::max();
    for (int height = count;;) {
        std::vector<Band> all = bands_of(rows, height);
        const int read = most_read(all);
        const std::size_t needed = rows.bytes(read, height);
        if (needed <= budget)
            return all;
        fewest = std::min(fewest, needed); // lower bands may take more, as where all passes of ssao share their depth
        const int least = std::clamp((read - height) / 8, std::min(rows.least, count), count);
        if (height <= least) {
            if (!what.empty())
                refuse_budget(what, fewest);
            return all;
        }
        const int parts = (count + height - 1) / height, more = std::max(parts + 1, parts * 11 / 10);
        height = std::max(std::min((count + more - 1) / more, height - 1), least);
    }
}

int most_read(const std::vector<Band>& all) {
    int most = 0;
    for (const Band& band : all)
        most = std::max(most, band.last - band.first);
    return most;
}

int most_made(const std::vector<Band>& all) {
    return all.front().end - all.front().begin;
}

std::size_t budget_of(const Device& device) {
    const std::size_t budget = device.options().memory_budget;
    return budget > 0 ? budget : no_budget;
}

void refuse_budget(std::string_view what, std::size_t needed) {
    constexpr std::size_t mebibyte = std::size_t{1} << 20;
    throw Error(text(what, " needs a memory budget of ", (needed + mebibyte - 1) / mebibyte, " MiB; raise it"));
}

} // namespace fathom
