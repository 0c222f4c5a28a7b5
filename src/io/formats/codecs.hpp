#pragma once

#include "metadata.hpp"

#include "io/formats.hpp"

#include <string>
#include <vector>

/// What stands before OpenCV's codecs: they fill what a file lacks with anything, so each format's bytes are checked first.
namespace fathom::io {

/// The pixels of a file whose bytes, which are taken, have been checked; it is refused where OpenCV reads none or another size. Nothing
/// is printed.
cv::Mat decoded(const std::filesystem::path& file, Bytes& bytes, cv::Size size);

/// `check_size`, and what OpenCV takes.
void check_codec_size(const std::filesystem::path& file, long long width, long long height);

/// The bytes of an image in B, G, R order, by the extension of the format and its parameters, as `cv::imencode` has them.
Bytes encoded(const std::string& extension, const cv::Mat& bgr, const std::vector<int>& parameters = {});

Bytes deflated(View content);

/// Of the formats that OpenCV reads. Each changes bytes that OpenCV takes otherwise than their format means them.
PictureFile read_png(const std::filesystem::path& file, Bytes& bytes);
PictureFile read_jpeg(const std::filesystem::path& file, Bytes& bytes);
PictureFile read_tiff(const std::filesystem::path& file, Bytes& bytes);
PictureFile read_pgm(const std::filesystem::path& file, Bytes& bytes, bool as_counted);
PictureFile read_radiance(const std::filesystem::path& file, Bytes& bytes);

} // namespace fathom::io
