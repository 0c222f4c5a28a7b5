#pragma once

#include "log.hpp"

#include "shot/inputs.hpp"

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

namespace fathom::cli {

/// What the page shows of a frame.
enum Role : std::size_t { output_role, input_role, depth_role, roles };

/// A frame of the page.
struct Entry {
    std::array<std::filesystem::path, roles> files = {}; ///< empty: it has none
    std::optional<Frame> frame = {};
    const Json* line = nullptr; ///< of the log
};

/// The results, and the frames of the log that have none, with the files that belong to them: those that are named, or those
/// that the log says.
/// Throws: UsageError where named files do not go with the results.
std::vector<Entry> entries_of(const std::array<Inputs, roles>& named, const Log& log);

} // namespace fathom::cli
