// Masks, alphas and confidences: which pixels of a depth image do not count.
#include "ignored.hpp"

#include <limits>

namespace fathom {
namespace {

using io::refuse;

/// The channels of an EXR that say it, in the order of `names`; an alpha or a confidence is one.
std::vector<std::string> mask_channels(const std::filesystem::path& file, bool is_confidence) {
    const std::vector<Channel> channels = list_channels(file);
    if (channels.size() == 1)
        return {channels.front().name};
    const Channel* best = nullptr;
    const auto place = [&](const Channel& channel) {
        return is_confidence ? io::place_of(channel.name, {"a", "alpha", "confidence"})
                             : io::place_of(channel.name, {"mask", "matte", "y", "v"});
    };
    for (const Channel& channel : channels)
        if (const auto its = place(channel); its && (!best || *its < *place(*best)))
            best = &channel;
    if (best)
        return {best->name};
    if (!is_confidence && channels.size() <= 4)
        if (const auto has = [&](const char* name) { return std::ranges::count(channels, name, &Channel::name) > 0; };
            has("R") && has("G") && has("B"))
            return {"B", "G", "R"};
    refuse(file, std::string("does not say which channel ") +
                     (is_confidence ? "is an alpha or a confidence" : "is the mask") + ": it has " +
                     io::listed(channels, &Channel::name) + "; save that one in a file of its own");
}

double largest_of(const cv::Mat& image) {
    return image.depth() == CV_8U ? 255 : image.depth() == CV_16U ? 65535 : 1;
}

/// Where a pixel does not count.
cv::Mat judged(const cv::Mat& image, std::optional<double> below, bool is_alpha) {
    cv::Mat floats;
    image.convertTo(floats, CV_32F);
    const int channels = floats.channels(), colors = std::min(channels, 3);
    const bool is_fraction = below && (is_alpha ? *below <= 1 : *below < 1);
    const double limit = is_fraction ? *below * largest_of(image) : below.value_or(0);
    cv::Mat ignored(image.size(), CV_8UC1);
    for (int y = 0; y < image.rows; ++y) {
        const auto* pixel = floats.ptr<float>(y);
        for (int x = 0; x < image.cols; ++x, pixel += channels) {
            const bool counts = below ? static_cast<double>(pixel[channels - 1]) >= limit
                                      : std::all_of(pixel, pixel + colors, [](float v) { return v == 0; });
            ignored.at<uchar>(y, x) = counts ? 0 : 255;
        }
    }
    return ignored;
}

} // namespace

io::IgnoredRows::IgnoredRows(const std::filesystem::path& file, std::optional<double> below, const Windows& windows)
    : file_(file), below_(below), windows_(windows) {
    check_readable(file);
    cv::Size size;
    const auto has_alpha = [&](int channels) {
        if (below && channels == 3)
            refuse(file, "has colours, but no alpha; --ignore-below needs an alpha, or a single channel");
        return channels > 3;
    };
    if (begins_like_exr(file)) {
        const std::vector<std::string> names = mask_channels(file, below.has_value());
        is_alpha_ = place_of(names.front(), {"a", "alpha"}).has_value();
        exr_ = exr_rows(file, names, {.overscan = true});
        size = exr_->channels().front().windows.display;
    } else if ((tiff_ = tiff_rows(file))) {
        is_alpha_ = has_alpha(CV_MAT_CN(tiff_->type()));
        size = tiff_->size();
    } else {
        const auto image = within_memory(file, [&] { return read_plain(file); });
        if (!image)
            refuse(file, "is no image whose zeros are kept, or its beginning is damaged; "
                         "masks are read from .png, .tif, .exr, .npy, .pfm and .pgm");
        is_alpha_ = has_alpha(image->channels());
        size = image->size();
        whole_ = judged(*image, below_, is_alpha_);
    }
    const cv::Size wanted = exr_ ? windows.display : windows.data.size();
    if (size != wanted)
        refuse(file, "is " + described(size) + ", but the depth is " + described(wanted) +
                         "; a mask has the size of the depth");
}

cv::Mat io::IgnoredRows::read(int rows) {
    const int first = at_;
    at_ += rows;
    if (tiff_)
        return judged(tiff_->read(rows), below_, is_alpha_);
    if (!exr_)
        return whole_.rowRange(first, at_);
    const cv::Rect data = exr_->channels().front().windows.data;
    cv::Mat all(rows, windows_.data.width, CV_8UC1, cv::Scalar(below_ && 0 < *below_ ? 255 : 0));
    const cv::Rect wanted(windows_.data.x, windows_.data.y + first, windows_.data.width, rows);
    const cv::Rect both = data & wanted;
    if (both.empty())
        return all;
    for (constexpr int most = 256; data.y + exr_at_ < both.y;) { // rows that the depth has not
        const int skipped = std::min(most, both.y - data.y - exr_at_);
        exr_->read(skipped);
        exr_at_ += skipped;
    }
    const std::vector<cv::Mat> planes = exr_->read(both.height);
    exr_at_ += both.height;
    cv::Mat merged;
    cv::merge(planes, merged);
    judged(merged, below_, is_alpha_)
        .colRange(both.x - data.x, both.x - data.x + both.width)
        .copyTo(all(both - wanted.tl()));
    return all;
}

cv::Mat io::ignored(const std::filesystem::path& file, std::optional<double> below, const Windows& windows) {
    return IgnoredRows(file, below, windows).read(windows.data.height);
}

} // namespace fathom
