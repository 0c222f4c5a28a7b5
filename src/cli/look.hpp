#pragma once

#include <fathom/findings.hpp>
#include <fathom/image.hpp>
#include <fathom/io.hpp>

#include <opencv2/core/mat.hpp>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace fathom::cli {

/// What a depth image is once it is decoded. Depths are in scene units along the view axis.
struct Look {
    std::size_t pixels = 0, invalid = 0, background = 0;
    float nearest = 0, farthest = 0; ///< of the surfaces; 0 where no pixel shows one
    cv::Mat z;                       ///< CV_32FC1: +infinity is background, NaN invalid

    std::size_t surfaces() const { return pixels - invalid - background; }
};

/// Stored values in host memory.
HostDepth on_host(const cv::Mat& values, Storage storage);

/// Decodes the image and counts. `depth` is what `stored.image` was made of.
Look look_at(const StoredDepth& stored);

/// Counts rows more, which are already decoded, but keeps none.
void add(Look& look, const cv::Mat& z);

/// The pixels of an image that are compared to tell which surfaces are flat, with those around them.
class Places {
public:
    /// All pixels of an image that is in memory.
    Places(const DepthFile& depth, const cv::Mat& z);

    /// Pixels of an image whose rows are added from the first to the last.
    Places(cv::Size size, Storage storage);
    void add(const cv::Mat& values, const cv::Mat& z);

    cv::Size size() const { return size_; }
    double value(int x, int y) const { return static_cast<double>(at(values_, x, y)); }
    double z(int x, int y) const { return static_cast<double>(at(z_, x, y)); }

    /// The step between neighbouring values, which bends whatever they mean.
    float step() const;

    static int distance(cv::Size size) { return std::max(1, std::min(size.width, size.height) / 40); }
    static int apart(int length) { return 1 + length / across; }

private:
    static constexpr int across = 128;

    float at(const cv::Mat& image, int x, int y) const {
        return rows_.empty()
                   ? image.at<float>(y, x)
                   : image.at<float>(rows_[static_cast<std::size_t>(y)], columns_[static_cast<std::size_t>(x)]);
    }
    void add_to_step(const cv::Mat& values, int first_row);

    cv::Size size_;
    Storage storage_;
    cv::Mat values_, z_;              // CV_32FC1
    std::vector<int> rows_, columns_; // of the image: where they lie in those; empty: all lie there
    std::vector<int> kept_columns_;
    int next_row_ = 0;
    float least_second_ = std::numeric_limits<float>::infinity(), highest_ = 0;
};

/// Depth that was looked at, and can be gone through again, whole or some rows after the others.
struct Subject {
    StoredDepth stored; ///< its image may be some rows of it
    Look look;
    std::function<void(const std::function<void(const cv::Mat& values, const cv::Mat& z)>&)> each;
    std::function<Places()> places;
};

/// What is probably wrong with the description of an image, a sentence each with the cure.
/// Throws: Error where no pixel has a depth, which says why that is likely.
std::vector<std::string> doubts(const Subject& subject);

/// "z 0.5 to 12, 3 % background, 96 of 9600 pixels invalid (1 %)": for the line about a result.
std::string in_words(const Look& look);

/// The end of it.
std::string invalid_in_words(std::size_t invalid, std::size_t pixels);

} // namespace fathom::cli
