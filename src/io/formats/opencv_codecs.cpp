// OpenCV's codecs. They may also print on stderr what they cannot decode; programs can redirect that.
#include "io/formats.hpp"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace fathom::io {

cv::Mat decode_with_opencv(const std::filesystem::path& file, const Bytes& bytes) {
    cv::Mat image;
    try {
        image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
    } catch (const cv::Exception&) {
        image.release();
    }
    if (image.empty())
        refuse(file, "is damaged or of a kind that OpenCV does not read; write it again");
    return image;
}

cv::Mat swap_red_and_blue(const cv::Mat& image) {
    if (image.channels() < 3)
        return image;
    cv::Mat swapped(image.size(), image.type());
    const int pairs[] = {0, 2, 1, 1, 2, 0, 3, 3};
    // cv::mixChannels crashes on halves; their bits are moved as integers.
    const auto movable = [](const cv::Mat& of) {
        return of.depth() == CV_16F ? cv::Mat(of.size(), CV_16UC(of.channels()), of.data, of.step) : of;
    };
    const cv::Mat from = movable(image);
    cv::Mat to = movable(swapped);
    cv::mixChannels(&from, 1, &to, 1, pairs, static_cast<std::size_t>(image.channels()));
    return swapped;
}

void swap_red_and_blue_of_row(cv::Mat& image, int row) {
    if (image.channels() >= 3)
        swap_red_and_blue(image.row(row)).copyTo(image.row(row));
}

} // namespace fathom::io
