#pragma once

#include "stopwatch.hpp"
#include "table.hpp"

#include <string>

namespace fathom::bench {

/// Every kernel that decodes depth against those that it is a case of, on the same input. A row is a pair, with the columns
///   operation, camera
///   kernel, wider      what the camera needs, and what can do more
///   arithmetic, place  fp64 or two floats; frames of width x height in turn, or one of 1024 x 256 that stays in the cache
///   ms                 of the kernel, median
///   ratio              time of the wider one / its time: ratio of medians, with the quartiles of the rounds' own ratios
///   control            the same of the kernel itself, timed twice
///   same_bits          share of the values in which both results have the same bits
///   ulp_apart          most units in the last place between them; of circles, in units of k's or a larger circle's
///   ulp_off, ulp_off_wider  largest error of both against `long double`, for linearize of float32
Table form_pairs(const Device& device, int width, int height, const std::string& only, int rounds, Clock clock);

} // namespace fathom::bench
