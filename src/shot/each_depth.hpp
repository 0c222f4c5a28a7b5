#pragma once

#include "plan.hpp"

#include "doubts/look.hpp"

#include <fathom/image.hpp>
#include <fathom/picture.hpp>

#include <opencv2/core/mat.hpp>

#include <functional>
#include <future>
#include <optional>
#include <utility>
#include <vector>

namespace fathom::cli {

/// The images beside its depth that a command reads for an input. Each command reads its own of them.
struct Images {
    Picture picture = {}, clean_plate = {};
    DepthFile other_depth{{}, Storage::float32, {}}; ///< of the same camera: the clean plate's, or where solids end
    cv::Mat normals = {}, thickness = {};
};

/// An input on its way from its files to its results, with the images that belong to it.
struct Loaded : Job {
    std::shared_future<Images> images = {}; ///< get() throws what was wrong with them
    std::vector<std::string> said = {};     ///< lines for stderr: warnings and explanations, in their order
};

/// Files of a command besides the depth images and their results.
struct More {
    std::vector<Companion> companions = {};
    std::vector<Output> outputs = {};
    std::optional<std::size_t> picture = {}; ///< which companion the result is made of, if not of the depth
    std::string color_layer = {};            ///< of that picture
    /// Reads the images. Other inputs are computed meanwhile, and others are read, too. The job has its windows.
    std::function<Images(const Job&)> read = {};
    /// What is probably wrong with the command's own options, a sentence each with the cure. Called beside `read`.
    std::function<std::vector<std::string>(const Job&)> doubts = {};
    /// The same of lengths, which this image is too large or too small for. Not asked where its depths are doubted anyway.
    std::function<std::vector<std::string>(const StoredDepth&, const Subject&, const Job&)> length_doubts = {};
};

/// An image that an operation made, and the format that it has as a picture.
struct Result {
    Result(cv::Mat made) : image(std::move(made)), size(image.size()) {}
    Result(Picture made) : image(std::move(made.color)), size(image.size()), format(std::move(made.format)) {}

    cv::Mat image;
    cv::Size size; ///< of the whole, if the image is a part
    std::optional<PictureFormat> format = {};
    std::optional<cv::Rect> part = {}; ///< of the depth image, if it has no more pixels
    cv::Mat normals = {}, colors = {}; ///< of points
};

/// Makes the images of a job: its result, then one for each of `More::outputs`.
using Operation = std::function<std::vector<Result>(const StoredDepth&, Loaded&)>;

/// Reads each input, runs the operation, writes the result and says so, in the order of the inputs. While one is computed, others
/// are read and written. A bad input is reported and the others are still done. Of an input's images all are written or none.
/// Gives the exit code.
/// Throws: UsageError, NoDevice and Interrupted, and Error for the camera file.
int each_depth(const DepthOptions& options, const Product& product, const More& more, const Operation& operation);

/// Throws: Error where another depth image does not lie where the depth does.
void check_same_pixels(const std::filesystem::path& file, const DepthFile& other, const Job& job);

/// Throws: Error where an image from another file is not of the depth's size.
void check_same_size(const std::filesystem::path& file, cv::Size size, const Job& job);

/// Throws: Error where the ratio of width to height is not that of the depth, by more than a pixel of the smaller one.
void check_same_view(const std::filesystem::path& file, cv::Size size, const Job& job);

/// Unit vectors as a file of this name holds them: in a .png ½n + ½ would make grey of (0, 0, 0), which is none, so it
/// becomes NaN, which is black there.
cv::Mat directions_for(const std::filesystem::path& file, cv::Mat directions);

} // namespace fathom::cli
