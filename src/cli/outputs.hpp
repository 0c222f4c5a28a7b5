#pragma once

#include "options.hpp"

#include <filesystem>
#include <vector>

namespace fathom::cli {

/// An input with the place of its result.
struct Job {
    std::filesystem::path input;
    std::filesystem::path output;
};

/// Decides where the results go, before anything is read or written.
/// OUT is a folder when it is one, when it ends with a slash, or when there are several inputs; a result is then
/// OUT/<name of the input without its ending><format>. Otherwise it is the file to write.
/// Throws: UsageError when two results would have the same name, when a result would replace an input or the camera
/// file, when the ending is not one of `endings`, or when .png is asked for without a scale.
std::vector<Job> plan(const DepthOptions& options, const std::vector<std::string>& endings);

/// Makes the folder of a result when OUT is a folder that is not there yet.
/// Throws: Error when it cannot be made, or when a single file is to go into a folder that does not exist.
void prepare_folder(const DepthOptions& options, const Job& job);

} // namespace fathom::cli
