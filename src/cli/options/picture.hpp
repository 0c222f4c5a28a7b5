#pragma once

#include "shot/each_depth.hpp"

#include <fathom/picture.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace CLI {
class App;
}

namespace fathom::cli {

/// The picture that an operation changes.
struct PictureOptions {
    std::string color, color_layer;
    const io::RawFormat* pixels = &io::raw_formats[2]; ///< of a pipe: rgb24
    std::optional<ColorEncoding> encoding;             ///< of the files; none: what their type says
};

/// A picture as a result, and its layer where it is appended to another one.
Product picture_product(const std::string& layer);

/// Adds --color and --color-layer. `what` names the picture: "the sharp picture".
void add_picture_options(CLI::App& app, PictureOptions& options, const std::string& what);

/// Makes the results of the picture, which is the first file beside each input. The options outlive `more`.
void use_picture(More& more, const PictureOptions& options);

/// Reads a picture of the depth's view, whose size may be another one.
/// Throws: Error for a file that is none, or one of another ratio of width to height.
Picture picture_of(const std::filesystem::path& file, const PictureOptions& options, const Job& job);

} // namespace fathom::cli
