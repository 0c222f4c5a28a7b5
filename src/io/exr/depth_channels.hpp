#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fathom::io {

/// Channels of an OpenEXR file that could be its depth by their names, whole names with that of the part. None of any other
/// file. Without a wish `read_depth` takes the likeliest of them.
std::vector<std::string> depth_channels(const std::filesystem::path& file);

} // namespace fathom::io
