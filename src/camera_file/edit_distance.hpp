#pragma once

#include <string_view>

namespace fathom::io {

/// Edits from one word to the other: insert, remove or replace a character, or swap two neighbours (optimal string
/// alignment).
std::size_t edit_distance(std::string_view a, std::string_view b);

} // namespace fathom::io
