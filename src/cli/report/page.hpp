#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace fathom::cli {

/// The page that shows this data: HTML that needs nothing but itself. No text of the data can become markup.
std::string page_of(const nlohmann::ordered_json& data);

} // namespace fathom::cli
