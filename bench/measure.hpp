#pragma once

#include "stopwatch.hpp"

#include <fathom/device.hpp>

#include <functional>
#include <string>
#include <vector>

namespace fathom::bench {

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
