#pragma once

#include "text.hpp"

#include <stdexcept>
#include <string>

namespace fathom {

/// Refuses what a caller asks for: std::invalid_argument with the option, its value and what would be right.
inline void require(bool condition, const std::string& message) {
    if (!condition)
        throw std::invalid_argument(message);
}

} // namespace fathom
