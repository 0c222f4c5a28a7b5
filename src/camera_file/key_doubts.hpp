#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace fathom::io {

/// What is probably wrong with the keys of a camera file for an image of this size, a sentence each with the cure.
/// `keys` is an object that `read_camera` accepts; of any other JSON nothing is said.
std::vector<std::string> key_doubts(const nlohmann::json& keys, int width, int height);

} // namespace fathom::io
