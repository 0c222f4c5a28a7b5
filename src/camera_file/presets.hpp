#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace fathom::io {

/// The camera file that a text NAME:key=value,... or key=value,... stands for. `source` stands in messages where a
/// file's name would.
nlohmann::json parsed_preset(const std::string& source, const std::string& text);

} // namespace fathom::io
