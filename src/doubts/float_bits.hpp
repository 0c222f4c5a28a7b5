#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace fathom {

/// What codes along lines of an image are: the bits of floats, or numbers. Over a smooth surface the bits of floats rise half as fast
/// above a power of two as below it, and numbers rise alike.
struct Bends {
    std::size_t of_floats = 0, of_numbers = 0;

    /// Looks at the powers of two that a line crosses, where floats have so many bits below the exponent.
    void add(std::span<const std::uint32_t> line, int mantissa_bits);
};

} // namespace fathom
