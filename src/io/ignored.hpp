#pragma once

#include <fathom/io.hpp>

#include <opencv2/core/mat.hpp>

#include <filesystem>
#include <optional>

namespace fathom::io {

/// Which pixels of a depth image do not count, out of a file: CV_8UC1, not 0 where a pixel does not.
/// `below`: pixels do not count whose alpha or confidence is less; without it those whose value is not 0. An alpha counts from
/// 0 to 1, and so do other integers where `below` is less than 1. `windows`: of the depth image.
/// Throws: Error for a file that cannot be read, without such a channel, or of another size than the depth.
cv::Mat ignored(const std::filesystem::path& file, std::optional<double> below, const Windows& windows);

} // namespace fathom::io
