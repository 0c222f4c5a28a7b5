#pragma once

#include "doubts/look.hpp"

#include <fathom/io.hpp>

#include <filesystem>
#include <string>

namespace fathom::io {

/// Relative depth, and what its file stores before values become 0 to 1.
struct RelativeInput {
    RelativeFile depth;
    std::string channel = {}; ///< of an OpenEXR file
    Look stored = {};         ///< the least value as the nearest
};

/// As `read_relative`.
RelativeInput read_relative_input(const std::filesystem::path& file, const ReadRelativeOptions& options);

} // namespace fathom::io
