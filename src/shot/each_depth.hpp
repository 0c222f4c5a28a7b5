#pragma once

#include "plan.hpp"

#include "doubts/look.hpp"

#include <fathom/image.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>

#include <opencv2/core/mat.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace fathom::shot {

/// An image that was made of an input, and the format that it has as a picture.
struct Made {
    Made(cv::Mat made) : image(std::move(made)), size(image.size()) {}

    cv::Mat image;
    cv::Size size; ///< of the whole, if the image is a part
    std::optional<PictureFormat> format = {};
    std::optional<cv::Rect> part = {}; ///< of the depth image, if it has no more pixels
    cv::Mat normals = {}, colors = {}; ///< of points
};

/// What a command does with each depth image.
class Task : public DepthOptions {
public:
    virtual ~Task() = default;

    /// Reads the images beside the depth. Other inputs are computed meanwhile, and others are read, too. The job has its windows.
    virtual Images read(const Job&) const { return {}; }

    /// Makes the images of `outputs`. Called for one input after the other.
    virtual std::vector<Made> make(const StoredDepth& stored, Job& job) = 0;

    /// What is probably wrong with the command's own options, a sentence each with the cure. Called beside `read`.
    virtual std::vector<std::string> doubts(const Job&) const { return {}; }

    /// The same of lengths, which this image is too large or too small for. Not asked where its depths are doubted anyway.
    virtual std::vector<std::string> length_doubts(const StoredDepth&, const Subject&, const Job&) const { return {}; }
};

/// Reads each input, does the task, writes the results and says so, in the order of the inputs. While one is computed, others
/// are read and written. A bad input is reported and the others are still done. Of an input's images all are written or none.
/// Gives the exit code.
/// Throws: UsageError, NoDevice and Interrupted, and Error for the camera file.
int each_depth(Task& task);

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

/// Throws: Error where another depth image does not lie where the depth does.
void check_same_pixels(const std::filesystem::path& file, const DepthFile& other, const Job& job);

/// Throws: Error where an image from another file is not of the depth's size.
void check_same_size(const std::filesystem::path& file, cv::Size size, const Job& job);

/// Throws: Error where the ratio of width to height is not that of the depth, by more than a pixel of the smaller one.
void check_same_view(const std::filesystem::path& file, cv::Size size, const Job& job);

/// Unit vectors as a file of this name holds them: in a .png ½n + ½ would make grey of (0, 0, 0), which is none, so it
/// becomes NaN, which is black there.
cv::Mat directions_for(const std::filesystem::path& file, cv::Mat directions);

} // namespace fathom::shot
