// Masks, alphas and confidences: which pixels of a depth image do not count.
#include "formats.hpp"

#include <algorithm>

namespace fathom {
namespace {

using io::IgnoredBy;
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
cv::Mat judged(const cv::Mat& image, const IgnoredBy& by, bool is_alpha) {
    cv::Mat floats;
    image.convertTo(floats, CV_32F);
    const int channels = floats.channels(), colors = std::min(channels, 3);
    const std::optional<double> limit_said = by.below ? by.below : by.above;
    const bool is_fraction = limit_said && (is_alpha ? *limit_said <= 1 : *limit_said < 1);
    const double limit = limit_said.value_or(0) * (is_fraction ? largest_of(image) : 1);
    cv::Mat ignored(image.size(), CV_8UC1);
    for (int y = 0; y < image.rows; ++y) {
        const auto* pixel = floats.ptr<float>(y);
        for (int x = 0; x < image.cols; ++x, pixel += channels) {
            const auto last = static_cast<double>(pixel[channels - 1]);
            const bool counts = by.below   ? last >= limit
                                : by.above ? last <= limit
                                           : std::all_of(pixel, pixel + colors, [](float v) { return v == 0; });
            ignored.at<uchar>(y, x) = counts ? 0 : 255;
        }
    }
    return ignored;
}

} // namespace

cv::Mat io::ignored(const std::filesystem::path& file, const IgnoredBy& by, const Windows& windows) {
    const auto check_fits = [&](cv::Size size, cv::Size wanted) {
        if (size != wanted)
            refuse(file, "is " + described(size) + ", but the depth is " + described(wanted) +
                             "; a mask has the size of the depth");
    };
    if (!begins_like_exr(file)) {
        constexpr Wanted wanted{"a mask", ".png, .tif, .exr, .npy, .pfm and .pgm"};
        const cv::Mat image = within_memory(file, [&] { return read_image(file, wanted).image; });
        if (by.is_limit() && image.channels() == 3)
            refuse(file, "has colours, but no alpha; a limit needs an alpha, or a single channel");
        check_fits(image.size(), windows.data.size());
        return judged(image, by, image.channels() > 3);
    }
    const std::vector<std::string> names = mask_channels(file, by.is_limit());
    const std::vector<DepthFile> held = read_exr(file, names, {.overscan = true});
    const cv::Rect data = held.front().windows.data, both = data & windows.data;
    check_fits(held.front().windows.display, windows.display);
    std::vector<cv::Mat> planes;
    for (const DepthFile& plane : held)
        planes.push_back(plane.values);
    cv::Mat merged,
        all(windows.data.size(), CV_8UC1, cv::Scalar(by.below && 0 < *by.below ? 255 : 0)); // beyond its data
    cv::merge(planes, merged);
    if (!both.empty())
        judged(merged(both - data.tl()), by, place_of(names.front(), {"a", "alpha"}).has_value())
            .copyTo(all(both - windows.data.tl()));
    return all;
}

} // namespace fathom
