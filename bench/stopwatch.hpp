#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace fathom::bench {

/// Seconds that a piece of work takes.
template <typename Work>
double seconds(Work&& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The value below which the share `q` of the samples lies.
inline double quantile(std::vector<double> samples, double q) {
    if (samples.empty())
        return 0;
    std::ranges::sort(samples);
    return samples[static_cast<std::size_t>(q * static_cast<double>(samples.size() - 1) + 0.5)];
}

inline double median(const std::vector<double>& samples) {
    return quantile(samples, 0.5);
}

} // namespace fathom::bench
