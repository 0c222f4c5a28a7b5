#pragma once

#include "rows.hpp"

#include <filesystem>
#include <memory>
#include <optional>

namespace fathom::io {

/// Which pixels of a depth image do not count, out of a file: row by row, from the first to the last.
class IgnoredRows {
public:
    /// `below`: pixels do not count whose alpha or confidence is less; without it those whose value is not 0. An alpha counts from
    /// 0 to 1, and so do other integers where `below` is less than 1. `windows`: of the depth image.
    /// Throws: Error for a file that cannot be read, without such a channel, or of another size than the depth.
    IgnoredRows(const std::filesystem::path& file, std::optional<double> below, const Windows& windows);

    /// The next rows: CV_8UC1, not 0 where a pixel does not count.
    cv::Mat read(int rows);

private:
    std::filesystem::path file_;
    std::optional<double> below_;
    Windows windows_;
    bool is_alpha_ = false;
    std::unique_ptr<ExrRows> exr_; // of its data window, beyond which nothing is said
    std::unique_ptr<TiffRows> tiff_;
    cv::Mat whole_; // of other files
    int at_ = 0, exr_at_ = 0;
};

/// All rows at once.
cv::Mat ignored(const std::filesystem::path& file, std::optional<double> below, const Windows& windows);

} // namespace fathom::io
