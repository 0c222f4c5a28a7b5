// Relative depth as it is read.
#include "telling.hpp"

#include "camera/photograph.hpp"
#include "io/formats.hpp"
#include "terminal/exit.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

namespace fathom::shot {

namespace {

using Ends = std::optional<std::array<double, 2>>;

io::Ignored ignored_of(const DepthOptions& options, const std::filesystem::path& mask) {
    return [&options, mask](cv::Size size) { return io::ignored(mask, options.ignore_below, {{{0, 0}, size}, size}); };
}

// The range of the floats of all these files; none of integers, whose range is that of their bits.
Ends range_of(const std::map<Frame, std::string>& files, const DepthOptions& options) {
    Ends range;
    for (const auto& [frame, file] : files) {
        stop_if_interrupted();
        try {
            const io::Ignored ignored =
                options.ignore.empty()
                    ? io::Ignored()
                    : ignored_of(options, companion_of(options, {"--ignore", options.ignore}, {file, frame}));
            const Ends own = io::range_of_floats(file, options.channel, ignored);
            if (!own)
                return std::nullopt;
            range = range ? Ends({std::min((*range)[0], (*own)[0]), std::max((*range)[1], (*own)[1])}) : own;
        } catch (const Error&) { // is told when the turn of this file comes
        }
    }
    return range && (*range)[0] < (*range)[1] ? range : std::nullopt;
}

// The number that `--relative-range` would be given.
double as_written(double value) {
    return std::stod(fmt::format("{}", static_cast<float>(value)));
}

} // namespace

std::vector<std::string> find_ranges(const DepthOptions& options, std::vector<Job>& jobs) {
    if (!options.relative.order || options.relative.options.range)
        return {};
    const Inputs::Shots shots = options.inputs.shots();
    std::vector<Ends> ranges;
    std::vector<std::string> said;
    for (const std::map<Frame, std::string>& files : shots.files) {
        Ends& range = ranges.emplace_back(range_of(files, options));
        if (!range)
            continue;
        range = {as_written((*range)[0]), as_written((*range)[1])};
        said.push_back(fmt::format("{0} to {1}  values {2} to {3} become 0 to 1 (--relative-range {2},{3})",
                                   files.begin()->second, files.rbegin()->second, (*range)[0], (*range)[1]));
    }
    for (std::size_t i = 0; i < jobs.size(); ++i)
        if (const auto shot = shots.of_inputs[i])
            jobs[i].range = ranges[*shot];
    return said;
}

RelativeDepth relative_depth(const DepthOptions& options, const Job& job) {
    RelativeDepth result;
    result.input =
        io::read_relative_input(job.input, options.channel,
                                options.ignore.empty() ? io::Ignored() : ignored_of(options, job.companions.back()));
    const cv::Mat stored = std::exchange(result.input.depth.values, {});
    const int bits = result.input.depth.bits;
    cv::Mat color;
    if (options.made_of)
        color = read_picture(job.companions[*options.made_of], {.layer = options.picture.layer, .encoding = {}}).color;
    RelativeOptions read = options.relative.options;
    if (!read.range && bits == 32)
        read.range = job.range;
    const auto floats = [](const cv::Mat& image) {
        return HostFloats{image.ptr<float>(), image.cols, image.rows, image.channels(), image.step1()};
    };
    const auto in_rows = [](int rows, const std::function<void(int, int)>& work) {
        cv::parallel_for_({0, rows}, [&](const cv::Range& part) { work(part.start, part.end); });
    };
    try {
        RelativeValues made = relative_values(floats(stored), bits, read, color.empty() ? HostFloats{} : floats(color),
                                              "--relative-range", in_rows);
        result.doubts = std::move(made.doubts);
        result.depth.values = cv::Mat(made.height, made.width, CV_32FC1, made.values.data()).clone();
    } catch (const std::invalid_argument& error) {
        throw Error(about(job.input, error.what()));
    }
    result.depth.windows = {{{0, 0}, result.depth.values.size()}, result.depth.values.size()};
    return result;
}

std::string in_words(const io::RelativeInput& input) {
    return fmt::format("values {} to {}, {}", number(input.look.nearest), number(input.look.farthest),
                       invalid_in_words(input.look.invalid, input.look.pixels));
}

} // namespace fathom::shot
