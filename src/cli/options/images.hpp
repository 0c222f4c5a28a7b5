#pragma once

#include "cli/command.hpp"
#include "shot/each_depth.hpp"

#include <fathom/picture.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace fathom::cli {

/// Adds --color and what says how it is read. `what` names the picture: "the sharp picture".
void add_picture_options(CLI::App& app, PictureOptions& options, const std::string& what);

/// Reads a picture of the depth's view, whose size may be another one.
/// Throws: Error for a file that is none, or one of another ratio of width to height.
Picture picture_of(const std::filesystem::path& file, const PictureOptions& options, const Job& job);

/// What is probably wrong with how the picture, which is the first companion, is said to count light.
std::vector<std::string> picture_doubts(const PictureOptions& options, const Job& job);

/// Throws: Error where two pictures of a view are not of one size, or where only one of them has an alpha.
void check_same_channels(const std::filesystem::path& file, const Picture& other, const Picture& picture,
                         const Job& job);

/// Reads a length for each pixel, as CV_32F.
/// Throws: Error for integers, and for an image of another size.
cv::Mat read_lengths(const std::filesystem::path& file, const Job& job);

} // namespace fathom::cli
