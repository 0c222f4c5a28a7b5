#pragma once

#include "text.hpp"

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

} // namespace fathom
