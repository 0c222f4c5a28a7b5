#pragma once

#include "each_depth.hpp"

#include <fathom/io.hpp>

#include <opencv2/core/mat.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fathom::cli {

/// The names of the channels that an image has: an alpha may be missing.
std::vector<std::string> channels_of(const Product& product, const cv::Mat& image);

/// Names that other programs know, beside a result's own in an EXR: a channel Y, which Blender and OpenCV open as a grey picture;
/// or channels of a layer "Fathom" that Blender lists among others, each called layer.pass.letter.
std::vector<std::string> known_names(std::vector<std::string> channels, bool append);

bool is_exr(const std::filesystem::path& file);

/// The EXR whose header the results keep: that of the picture they are made of, or that of the depth.
std::optional<ExrSource> source_of(const DepthOptions& options, const Job& job, const DepthFile& depth);

/// The windows of the results: those of the depth, or less where the picture that they are made of has fewer pixels.
Windows result_windows(const DepthOptions& options, const Job& job);

/// A file that has no windows gets the pixels of the display window. So it does not depend on where a renderer had pixels.
void fit(cv::Mat& image, const Windows& windows, const std::filesystem::path& file, ImageKind kind);

/// The files of a job's results, in the order of the outputs.
/// Throws: Error for a result of another size that is to be appended.
std::vector<ImageFile> files_of(const DepthOptions& options, const Job& job, const std::vector<Made>& results,
                                const std::optional<ExrSource>& source);

/// A --png-scale that cuts values off, or leaves only a few codes to them.
std::vector<std::string> png_doubts(const DepthOptions& options, const Job& job, const std::vector<Made>& results);

/// A result that cannot hold what goes with the picture it is made of.
std::vector<std::string> metadata_doubts(const std::filesystem::path& file, const Made& result);

} // namespace fathom::cli
