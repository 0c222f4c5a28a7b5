#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fathom::io {

/// Channels of an OpenEXR file that are named like depth, by their full names: Z, Depth or Depth.V, alone or at the end of a
/// layer's name, but not the third one of a vector. None of any other file.
std::vector<std::string> depth_channels(const std::filesystem::path& file);

} // namespace fathom::io
