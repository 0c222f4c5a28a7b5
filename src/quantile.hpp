#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace fathom {

/// The value than which a part of some values is less: by default half of them, so that it is their median. There is at least one value,
/// and none is NaN. `part`: from 0 to below 1.
template <typename T>
T quantile(std::vector<T> values, double part = 0.5) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size()));
    std::ranges::nth_element(values, at);
    return *at;
}

} // namespace fathom
