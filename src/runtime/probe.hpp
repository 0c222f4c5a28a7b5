#pragma once

#include <fathom/probe.hpp>

#include <vector>

namespace fathom::runtime {

/// Operands, and what became of them: a / b, the root of a, a b + c rounded once, c / b, a / probe_divisor, a b + c rounded
/// twice, and c + 0.
template <typename Number>
struct Cases {
    std::vector<Number> a, b, c;
};
template <typename Number>
struct Results {
    std::vector<Number> quotient, root, fused, second_quotient, by_constant, sum, sum_with_zero;
};

/// As many hard cases of division, of roots, of fused products and of denormals each as `count` / 4.
template <typename Number>
Cases<Number> hard_cases(std::size_t count);

/// What this processor makes of them, which rounds correctly.
template <typename Number>
Results<Number> right_results(const Cases<Number>& cases);

/// The worst of the results. `fp64` is left alone.
template <typename Number>
DeviceArithmetic judged(const Cases<Number>& cases, const Results<Number>& right, const Results<Number>& found);

} // namespace fathom::runtime
