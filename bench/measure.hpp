#pragma once

#include <fathom/device.hpp>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

namespace fathom::bench {

/// Time on the wall, or processor time of all threads: the latter is what a busy machine leaves comparable.
enum class Clock { wall, processor };

inline double now(Clock clock) {
    if (clock == Clock::processor)
        return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Seconds that a piece of work takes.
template <typename Work>
double seconds(Clock clock, Work&& work) {
    const double start = now(clock);
    work();
    return now(clock) - start;
}

/// The value below which the fraction `q` of the samples lies.
inline double quantile(std::vector<double> samples, double q) {
    if (samples.empty())
        return 0;
    std::ranges::sort(samples);
    return samples[static_cast<std::size_t>(q * static_cast<double>(samples.size() - 1) + 0.5)];
}

inline double median(const std::vector<double>& samples) {
    return quantile(samples, 0.5);
}

/// Work that is timed.
struct Work {
    std::function<void()> before = {}; ///< not timed
    std::function<void()> run;
    std::function<void()> after = {}; ///< not timed
    int every = 1;                    ///< rounds from one run to the next
};

/// Seconds of each piece of work: rounds are interleaved in random order, after some that are not counted.
std::vector<std::vector<double>> measured(const Device& device, const std::vector<Work>& work, int rounds, Clock clock,
                                          int warm_up = 2);

/// Runs the work once, and once more unless that took too long, and chooses how many rounds lie from one run to the next, so
/// that all of `rounds` take no more than about so many seconds; but for three runs at least.
int rounds_between(const Device& device, const Work& work, int rounds, double seconds);

} // namespace fathom::bench
