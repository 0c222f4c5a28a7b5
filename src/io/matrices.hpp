#pragma once

#include <fathom/image.hpp>

#include <opencv2/core.hpp>

#include <functional>
#include <optional>
#include <vector>

namespace fathom::io {

/// The type of a matrix that holds such an image.
int mat_type(Element element, int channels);

/// The image in a cv::UMat's own memory, if the device can work there: OpenCV keeps it in a buffer of the device's
/// context, and no cv::Mat holds it mapped.
/// Throws: std::invalid_argument for a matrix that is no image.
std::optional<Image> image_in(const Device& device, const cv::UMat& umat, cv::AccessFlag access);

/// The image in a cv::Mat: its memory on a CPU device, a copy on any other.
Image image_in(const Device& device, const cv::Mat& mat);

/// An image that holds a copy of a cv::UMat, whatever the device.
Image copy_of(const Device& device, const cv::UMat& umat);

/// What the device's queue is given from now on waits for what OpenCV's queue was given before.
void follow_opencv(const Device& device);

/// The matrices that one call of an operation reads and writes, as images on the device. A result whose matrix has
/// another size or type is made anew. It reaches the caller only after the operation did not throw.
class Matrices {
public:
    explicit Matrices(const Device& device) : device_(device) {}

    const Device& device() const { return device_; }
    Image read(cv::InputArray array);

    /// Throws: std::invalid_argument for an array that cannot take this size and type.
    Image write(cv::OutputArray array, cv::Size size, int type);

    /// Runs the operation after what OpenCV's queue was given before, and before what that is given later. Waits for
    /// the operation if host memory takes part.
    void run(const std::function<void()>& operation);

private:
    struct Result {
        cv::OutputArray array;
        bool made_anew;
        cv::UMat umat; // outlives the cv::Mat that maps it
        cv::Mat mat;   // empty if the device writes into the cv::UMat
        Image image;
    };

    bool host_takes_part() const;
    void let_opencv_follow() const;

    Device device_;
    std::vector<cv::UMat> mapped_; // outlive the cv::Mats that map them
    std::vector<cv::Mat> mats_;    // that the device reads
    std::vector<cv::UMat> umats_;  // in whose memory the device reads or writes
    std::vector<Result> results_;
};

} // namespace fathom::io
