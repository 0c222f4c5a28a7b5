// Relative depth out of files, and onto the grid of a picture.
#include "floats_on_host.hpp"
#include "formats.hpp"
#include "relative_input.hpp"

#include "camera/photograph.hpp"

#include <fathom/error.hpp>

#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace fathom {

using io::refuse;

cv::Mat io::only_channel(const std::filesystem::path& file, const cv::Mat& image) {
    const int channels = image.channels();
    if (channels == 1)
        return image;
    if (channels != 3 && channels != 4)
        refuse(file, "is " + io::described(image) + "; depth without a unit has one channel, or R = G = B");
    if (image.depth() == CV_16F) { // which OpenCV 4.6 has no differences of
        cv::Mat floats;
        image.convertTo(floats, CV_32F);
        return only_channel(file, floats);
    }
    std::array<cv::Mat, 4> planes;
    cv::split(image, planes.data());
    for (int c = 1; c < 3; ++c) {
        double largest = 0;
        cv::Point where;
        cv::Mat difference;
        cv::absdiff(planes[0], planes[static_cast<std::size_t>(c)], difference);
        cv::minMaxLoc(difference, nullptr, &largest, nullptr, &where);
        if (largest > 0)
            refuse(file, "has colours, as at pixel (" + std::to_string(where.x) + ", " + std::to_string(where.y) +
                             "): it is a picture, or depth painted with a colour map, which cannot be undone; "
                             "save the depth in grey");
    }
    return planes[0];
}

io::RelativeInput io::read_relative_input(const std::filesystem::path& file, const std::string& channel,
                                          const Ignored& ignored) {
    constexpr Wanted wanted{"relative depth", ".png, .jpg, .tif, .pfm, .npy, .npz and .exr", true};
    return within_memory(file, [&] {
        RelativeInput result;
        cv::Mat image;
        if (begins_like_exr(file)) {
            const DepthFile depth = read_exr(file, {channel}, {}).front();
            image = depth.values;
            result.channel = depth.channel;
        } else {
            image = read_image(file, wanted, {.channel = channel}).image;
        }
        const int type = image.depth();
        if (type != CV_8U && type != CV_16U && type != CV_16F && type != CV_32F)
            refuse(file, "is " + described(image) + "; relative depth has 8 or 16 bits, or floats");
        result.depth.bits = type == CV_8U ? 8 : type == CV_16U ? 16 : 32;
        cv::Mat& values = result.depth.values;
        only_channel(file, image).convertTo(values, CV_32F);
        if (ignored)
            values.setTo(std::numeric_limits<double>::quiet_NaN(), ignored(values.size()));
        result.look.add(on_host(values));
        return result;
    });
}

std::optional<std::array<double, 2>> io::range_of_floats(const std::filesystem::path& file, const std::string& channel,
                                                         const Ignored& ignored) {
    const RelativeInput input = read_relative_input(file, channel, ignored);
    if (input.depth.bits < 32)
        return std::nullopt;
    if (input.look.surfaces() == 0)
        return std::array<double, 2>{INFINITY, -INFINITY};
    return std::array<double, 2>{input.look.nearest, input.look.farthest};
}

RelativeFile read_relative(const std::filesystem::path& file, const ReadRelativeOptions& options) {
    RelativeFile depth = io::read_relative_input(file, options.channel).depth;
    try {
        to_fractions({depth.values.ptr<float>(), depth.values.total()}, depth.bits, options.range);
    } catch (const std::invalid_argument& error) {
        refuse(file, error.what());
    }
    return depth;
}

cv::Mat upsample_along_edges(const cv::Mat& depth, const cv::Mat& color) {
    if (depth.type() != CV_32FC1 || color.depth() != CV_32F || color.channels() < 3 || depth.empty() || color.empty())
        throw Error("depth must be CV_32FC1 and the picture CV_32FC3 or CV_32FC4, and neither may be empty");
    const EdgeUpsampling upsampling(io::on_host(depth), io::on_host(color));
    cv::Mat result(color.size(), CV_32FC1);
    cv::parallel_for_(cv::Range(0, color.rows), [&](const cv::Range& rows) {
        upsampling.rows(rows.start, rows.end, result.ptr<float>(rows.start));
    });
    return result;
}

cv::Mat io::distances_along_edges(const cv::Mat& z, const cv::Mat& color, bool perspective) {
    const EdgeUpsampling upsampling(on_host(z), on_host(color));
    cv::Mat result(color.size(), CV_32FC1);
    cv::parallel_for_(cv::Range(0, color.rows), [&](const cv::Range& rows) {
        upsampling.rows_of_distances(rows.start, rows.end, perspective, result.ptr<float>(rows.start));
    });
    return result;
}

} // namespace fathom
