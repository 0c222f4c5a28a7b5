// What the page of a report shows of its files: small pictures whose colours can be compared.
#include "pictures.hpp"

#include "camera_file/file.hpp"
#include "io/formats.hpp"
#include "terminal/interrupt.hpp"

#include <fathom/error.hpp>
#include <fathom/frames.hpp>

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

std::string base64(const std::vector<unsigned char>& bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t three = 0;
        for (std::size_t k = 0; k < 3; ++k)
            three = three << 8 | (i + k < bytes.size() ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += i + k <= bytes.size() ? digits[three >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

// Each pixel is the mean of those that it covers.
cv::Mat shrunk(const cv::Mat& picture, int width) {
    if (picture.cols <= width)
        return picture;
    const double height = std::round(picture.rows * static_cast<double>(width) / picture.cols);
    cv::Mat small;
    cv::resize(picture, small, {width, std::max(1, static_cast<int>(height))}, 0, 0, cv::INTER_AREA);
    return small;
}

// The picture of an image, not wider than this. Light is added as light; a color that is invalid stays so in any mean.
cv::Mat small_picture(const Viewed& viewed, const ColorRange& range, ColorMap map, int width) {
    if (viewed.kind != Viewed::Kind::picture || viewed.image.cols <= width)
        return shrunk(false_color(viewed, range, map), width);
    Viewed small = viewed;
    cv::Mat cut = viewed.image.clone();
    for (int y = 0; y < cut.rows; ++y) {
        auto* row = cut.ptr<float>(y);
        std::transform(row, row + cut.cols * cut.channels(), row, [](float value) {
            return std::isfinite(value) ? std::min(value, 1.0f) : std::numeric_limits<float>::quiet_NaN();
        });
    }
    small.image = shrunk(cut, width);
    return false_color(small, range, map);
}

// A JPEG of at most so many bytes, if any quality makes one.
std::string data_uri(const cv::Mat& picture, std::size_t most_bytes) {
    std::vector<unsigned char> bytes;
    cv::Mat smaller = picture;
    for (;;) {
        for (const int quality : {90, 82, 74, 64, 50}) {
            bytes = io::jpeg_bytes(smaller, {}, quality);
            if (bytes.size() <= most_bytes)
                return "data:image/jpeg;base64," + base64(bytes);
        }
        if (smaller.cols <= 160)
            return "data:image/jpeg;base64," + base64(bytes);
        smaller = shrunk(picture, smaller.cols * 3 / 4);
    }
}

void check_disk_of(const std::exception_ptr& failure) {
    try {
        if (failure)
            std::rethrow_exception(failure);
    } catch (const io::UnansweredRead&) {
        throw;
    } catch (const std::exception&) { // is told with its frame
    }
}

} // namespace

Room room_for(std::size_t frames, std::size_t pictures_a_frame) {
    constexpr double page_bytes = 9.6e6, least_bytes = 3000, most_bytes = 120e3; // before base64 adds a third
    const double each = page_bytes / static_cast<double>(frames * pictures_a_frame);
    return {frames <= 24    ? 960
            : frames <= 120 ? 720
                            : 512,
            static_cast<std::size_t>(std::clamp(each, least_bytes, most_bytes))};
}

std::optional<Layer> layer_of(const std::vector<Entry>& entries, Role role, const std::string& channel) {
    constexpr std::size_t most = 12;
    std::vector<fs::path> files;
    for (const Entry& entry : entries)
        if (!entry.files[role].empty())
            files.push_back(entry.files[role]);
    const std::size_t count = std::min(most, files.size());
    std::vector<Viewed> viewed(count);
    std::vector<Statistics> found(count);
    for_each_frame<int>(
        count,
        {.read =
             [&](std::size_t i, int&) {
                 const std::size_t place = count == 1 ? 0 : i * (files.size() - 1) / (count - 1);
                 Viewed each = read_viewed(files[place], channel);
                 found[i] = statistics_of(each);
                 each.image.release();
                 viewed[i] = std::move(each);
             },
         .report = [](std::size_t, int&, const std::exception_ptr& failure) { check_disk_of(failure); }},
        {.stop = is_interrupted});
    const auto first = std::ranges::find_if(found, [](const Statistics& each) { return each.pixels > 0; });
    if (first == found.end())
        return std::nullopt;
    Layer layer{viewed[static_cast<std::size_t>(first - found.begin())]};
    Statistics all;
    for (const Statistics& each : found) {
        if (!each.any())
            continue;
        all.least = all.any() ? std::min(all.least, each.least) : each.least;
        all.greatest = all.any() ? std::max(all.greatest, each.greatest) : each.greatest;
        all.sample.insert(all.sample.end(), each.sample.begin(), each.sample.end());
    }
    std::ranges::sort(all.sample);
    layer.range = choose_range(all, layer.first.from_0_to_1);
    return layer;
}

Shown shown_of(const fs::path& file, const std::string& channel, const Layer& layer, ColorMap map, const Room& room) {
    const Viewed viewed = read_viewed(file, channel);
    Shown shown{.picture = data_uri(small_picture(viewed, layer.range, map, room.width), room.bytes_each),
                .found = statistics_of(viewed),
                .size = viewed.image.size()};
    constexpr int bins = 60;
    if (viewed.kind == Viewed::Kind::values) {
        shown.histogram.resize(bins);
        for (const double value : shown.found.sample)
            ++shown.histogram[static_cast<std::size_t>(std::clamp(layer.range.place(value) * bins, 0.0, bins - 1.0))];
    }
    return shown;
}

} // namespace fathom::cli
