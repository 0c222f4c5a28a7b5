#pragma once

#include "plan.hpp"

#include "doubts/look.hpp"

#include <fathom/image.hpp>
#include <fathom/picture.hpp>

#include <opencv2/core/mat.hpp>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace fathom::cli {

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
