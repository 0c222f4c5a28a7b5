#pragma once

#include "text.hpp"

#include <fathom/error.hpp>

#include <cfenv>
#include <stdexcept>
#include <string>

namespace fathom {

/// Refuses what a caller asks for: std::invalid_argument with the option, its value and what would be right, or another
/// exception. The message is made of its parts only then, because every launch asks dozens of times.
template <typename Exception = std::invalid_argument, typename... Part>
void require(bool condition, const Part&... message) {
    if (!condition)
        throw Exception(text(message...));
}

/// Refuses a thread that rounds otherwise than to nearest: it, and the threads that a driver starts from it, would compute other bits.
inline void require_rounding() {
    require<Error>(std::fegetround() == FE_TONEAREST,
                   "this thread does not round floating-point numbers to the nearest "
                   "one; set that first: std::fesetround(FE_TONEAREST)");
}

} // namespace fathom
