#pragma once

namespace fathom {
#pragma GCC visibility push(default)

/// How much work `ssao` and `dof` spend on a pixel: the first is the quickest, the last has the smallest errors.
enum class Quality { fast, balanced, accurate };

/// A tolerance, in place of how to compute something: the fastest method whose measured error is at most this in every scene of
/// docs/performance.md is used, `cheapest_method` of cheapest.hpp. Above 0.
struct MaxError {
    double value;
};

#pragma GCC visibility pop
} // namespace fathom
