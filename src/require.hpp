#pragma once

#include "text.hpp"

#include <stdexcept>
#include <string>

namespace fathom {

/// Refuses what a caller asks for: std::invalid_argument with the option, its value and what would be right. The message is
/// made of its parts only then, because every launch asks dozens of times.
template <typename... Part>
void require(bool condition, const Part&... message) {
    if (!condition)
        throw std::invalid_argument(text(message...));
}

} // namespace fathom
