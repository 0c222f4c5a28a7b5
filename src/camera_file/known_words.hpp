#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::io {

/// The object of the camera file that a key stands in; empty where it stands in none.
std::string object_of(std::string_view key);

/// The key that stands for what other programs call so, as a message says it; empty for a name that none is known to use.
std::string key_for(std::string_view name);

/// Edits from one word to the other: insert, remove or replace a character, or swap two neighbours (optimal string
/// alignment).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The words that are the fewest edits away from `word`, the nearest first: `most` of them.
bool is_near(std::string_view known, std::string_view word);
std::vector<std::string> nearest_words(std::vector<std::string> known, std::string_view word, std::size_t most);

} // namespace fathom::io
