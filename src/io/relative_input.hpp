#pragma once

#include <fathom/io.hpp>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>

namespace fathom::io {

/// Relative depth, and what its file stores before values become 0 to 1.
struct RelativeInput {
    RelativeFile depth;
    std::string channel = {};           ///< of an OpenEXR file
    double least = NAN, greatest = NAN; ///< of the finite values
    std::size_t pixels = 0;
    std::size_t invalid = 0; ///< pixels that hold NaN
};

/// As `read_relative`.
RelativeInput read_relative_input(const std::filesystem::path& file, const ReadRelativeOptions& options);

} // namespace fathom::io
