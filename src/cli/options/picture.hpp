#pragma once

#include "depth_options.hpp"

#include "io/rows.hpp"

#include <fathom/image.hpp>
#include <fathom/picture.hpp>

#include <opencv2/core/mat.hpp>

#include <filesystem>
#include <memory>
#include <string>

namespace fathom::cli {

struct Job;

/// The picture that an operation changes.
struct PictureOptions {
    std::string color, color_layer;
    std::optional<ColorEncoding> encoding; ///< of the files; none: what their type says
};

/// A picture as a result, and its layer where it is appended to another one.
Product picture_product(const std::string& layer);

/// What is probably wrong with how the picture is said to count light. It is the first file beside the job's depth.
std::vector<std::string> picture_doubts(const PictureOptions& options, const Job& job);

/// Adds --color and --color-layer. `what` names the picture: "the sharp picture".
void add_picture_options(CLI::App& app, PictureOptions& options, const std::string& what);

/// Reads a picture of the depth's size.
/// Throws: Error for a file that is none, or one of another size.
Picture picture_of(const std::filesystem::path& file, const PictureOptions& options, const Job& job);

/// The same by rows; nothing for a file that has to be read whole.
std::unique_ptr<io::PictureRows> picture_rows_of(const std::filesystem::path& file, const PictureOptions& options,
                                                 const Job& job);

} // namespace fathom::cli
