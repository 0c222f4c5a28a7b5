#pragma once

#include "options.hpp"

#include <filesystem>
#include <vector>

namespace fathom::cli {

/// An image to write for each input.
struct Output {
    std::string option; ///< that says where: -o, --confidence
    std::string target; ///< file or folder
    Product product;
};

/// An image to read with each input.
struct Companion {
    std::string option; ///< that says where: --normals
    std::string source; ///< a file, or a folder in which it is named like the input
};

/// An input with the files that belong to it.
struct Job {
    std::filesystem::path input;
    std::vector<std::filesystem::path> companions;
    std::vector<std::filesystem::path> outputs;
    Windows windows = {};                  ///< of the depth, once it is read
    std::optional<CameraFile> header = {}; ///< the camera, if it is that of the depth's own header

    /// All but the input.
    std::vector<std::filesystem::path> others() const;
};

/// A file's extension as `Product::extensions` has it: in small letters, .tif for .tiff.
std::string extension_of(const std::filesystem::path& file);

/// Decides where everything lies, before anything is read or written.
/// A target is a folder when it is one, when it ends with a slash, or when there are several inputs; a result is then
/// <folder>/<name of the input without its extension><format>. Otherwise it is the file to write. In a folder of companions
/// the same name is looked for with the extensions that images have.
/// Throws: UsageError when two results would have the same name, when a result would replace a file that is read, when
/// the extension is not one of the product's, when .png is asked for without a scale, or when several inputs share a
/// companion.
std::vector<Job> plan(const DepthOptions& options, const std::vector<Output>& outputs,
                      const std::vector<Companion>& companions = {});

/// Makes the folders of results whose targets are folders that are not there yet.
/// Throws: Error when one cannot be made, or when a single file is to go into a folder that does not exist.
void prepare_folders(const DepthOptions& options, const std::vector<Output>& outputs, const Job& job);

} // namespace fathom::cli
