#pragma once

#include <string>
#include <string_view>

namespace fathom::io {

/// The object of the camera file that a key stands in; empty where it stands in none.
std::string object_of(std::string_view key);

/// The key that stands for what other programs call so, as a message says it; empty for a name that none is known to use.
std::string key_for(std::string_view name);

} // namespace fathom::io
