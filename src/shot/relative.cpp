// Relative depth as it is read.
#include "relative.hpp"

#include "terminal/messages.hpp"

#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <cmath>
#include <span>

namespace fathom::cli {

RelativeDepth relative_depth(const RelativeOptions& relative, const Job& job, const std::string& channel) {
    constexpr double little_range = 0.1; // of 0 to 1
    RelativeDepth result;
    result.input = io::read_relative_input(job.input, {.channel = channel, .range = relative.range});
    cv::Mat& values = result.depth.values = std::move(result.input.depth.values);
    const int bits = result.input.depth.bits;
    const auto all = [&] { return std::span(values.ptr<float>(), values.total()); };
    if (bits == 8 && !relative.range)
        smooth_steps(all(), values.cols, values.rows, 1 / 255.0);
    double least = 0, most = 1;
    cv::minMaxLoc(values, &least, &most);
    if (!relative.range && most - least < little_range)
        result.doubts.push_back(
            fmt::format("its values take {:.2g} % of what {} bits hold, so that little is blurred; say with "
                        "--relative-range which codes are nearest and farthest",
                        100 * (most - least), bits));
    if (relative.picture) {
        const std::filesystem::path& file = job.companions[*relative.picture];
        const cv::Mat color = read_picture(file, {.layer = relative.color_layer, .encoding = {}}).color;
        const double aspect = static_cast<double>(color.cols) / color.rows * values.rows / values.cols;
        if (std::abs(aspect - 1) > 0.01)
            throw Error(
                fmt::format("{}: is {} × {}, but {} is {} × {}; both must show the same, with the same ratio of "
                            "width to height",
                            job.input.native(), values.cols, values.rows, file.native(), color.cols, color.rows));
        if (values.size() != color.size())
            values = upsample_along_edges(values, color);
    }
    if (relative.focus_range)
        flatten_range(all(), *relative.focus_range);
    result.depth.windows = {{{0, 0}, values.size()}, values.size()};
    return result;
}

std::string in_words(const io::RelativeInput& input) {
    return fmt::format("values {} to {}, {}", number(input.stored.nearest), number(input.stored.farthest),
                       invalid_in_words(input.stored.invalid, input.stored.pixels));
}

} // namespace fathom::cli
