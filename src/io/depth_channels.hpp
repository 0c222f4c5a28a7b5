#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fathom::io {

/// Channels of an OpenEXR file that are named like depth, by their full names; none of any other file. A grey image (Y) counts
/// only if nothing else does.
std::vector<std::string> depth_channels(const std::filesystem::path& file);

} // namespace fathom::io
