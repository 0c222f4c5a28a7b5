#pragma once

#include "entries.hpp"

#include "cli/show/false_color.hpp"

#include <opencv2/core/types.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fathom::cli {

/// Width of the pictures, and bytes that each may take: a page of 240 frames stays below 15 MB.
struct Room {
    int width;
    std::size_t bytes_each;
};

Room room_for(std::size_t frames, std::size_t pictures_a_frame);

/// How all frames of a role are shown, so that they can be compared.
struct Layer {
    Viewed first = {}; ///< without its image
    ColorRange range = {};
};

/// The layer of a role, as a few frames all over the shot have it. None where no file can be read.
/// Throws: io::UnansweredRead: a page without what lies on a disk that does not answer would look as if there were no more.
std::optional<Layer> layer_of(const std::vector<Entry>& entries, Role role, const std::string& channel);

/// What becomes of a file.
struct Shown {
    std::string picture; ///< a data: URI
    Statistics found = {};
    std::vector<std::size_t> histogram = {};
    cv::Size size = {};
};

/// Throws: Error for a file that cannot be read.
Shown shown_of(const std::filesystem::path& file, const std::string& channel, const Layer& layer, ColorMap map,
               const Room& room);

} // namespace fathom::cli
