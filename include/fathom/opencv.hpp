#pragma once

#include <fathom/image.hpp>
#include <fathom/linearize.hpp>
#include <fathom/unproject.hpp>

#include <opencv2/core/mat.hpp>

namespace fathom {

/// The storage that a matrix holds by its type: CV_32F, CV_16F, CV_16U, CV_32S (uint24), CV_8UC3 (rgb8_red_low).
/// Throws: std::invalid_argument for any other type.
Storage storage_of(const cv::Mat& stored);

/// The device's view of a matrix: shared memory on a CPU device, a copy on any other. The matrix must outlive it.
Image to_device(const Device& device, const cv::Mat& mat);

/// A device image as a matrix.
cv::Mat to_mat(const Image& image);

/// View-space depth (CV_32FC1) of a stored depth image; see linearize.hpp. On a CPU device nothing is copied.
cv::Mat linearize(const Device& device, const cv::Mat& stored, const Camera& camera,
                  const LinearizeOptions& options = {});

/// Positions (CV_32FC3 or CV_32FC4) of a stored depth image; see unproject.hpp. On a CPU device nothing is copied.
cv::Mat unproject(const Device& device, const cv::Mat& stored, const Camera& camera,
                  const UnprojectOptions& options = {});

} // namespace fathom
