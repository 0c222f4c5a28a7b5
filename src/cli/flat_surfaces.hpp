#pragma once

#include "look.hpp"

#include <optional>
#include <string>

namespace fathom::cli {

/// What is probably wrong where flat surfaces are bent as the camera file describes them, but flat under another encoding.
std::optional<std::string> flat_surfaces_doubt(const Subject& subject);

} // namespace fathom::cli
