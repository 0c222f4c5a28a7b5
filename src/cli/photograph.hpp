#pragma once

#include "look.hpp"

#include <optional>
#include <string>

namespace fathom::cli {

/// What is probably wrong where three bytes that count as packed depth are the colours of a picture.
std::optional<std::string> photograph_doubt(const Subject& subject);

} // namespace fathom::cli
