#pragma once

#include <fathom/camera.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fathom::io {

/// Channels of an OpenEXR file that could be its depth by their names, whole names with that of the part. None of any other
/// file. Without a wish `read_depth` takes the likeliest of them.
std::vector<std::string> depth_channels(const std::filesystem::path& file);

/// What is probably wrong if depth of a channel of this name counts as the camera says.
std::optional<std::string> ray_channel_doubt(const std::string& channel, const Camera& camera);

} // namespace fathom::io
