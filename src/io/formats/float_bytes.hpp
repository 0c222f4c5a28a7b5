#pragma once

#include "doubts/look.hpp"

#include <opencv2/core/mat.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fathom::io {

/// Are four bytes those of a float, in any order? Fractions and colours are not: floats that are lengths have nearly the same sign and
/// exponent everywhere, and their mantissa bends at powers of two.
class FloatBytes {
public:
    /// Looks at B, G, R and A.
    void add(const cv::Mat& bgra);

    bool are_floats() const;

private:
    struct Order {
        std::vector<std::uint32_t> lengths; ///< bits, without the sign
        std::size_t others = 0, negative = 0, pairs = 0, smooth = 0;
        Bends bends = {};

        bool is_of_floats(std::size_t seen) const;
    };
    std::array<Order, 4> orders_ = {};
    std::size_t seen_ = 0;
};

} // namespace fathom::io
