// Relative depth for `fathom dof` and `fathom dof-masks`.
#include "relative.hpp"

#include "codecs.hpp"
#include "command.hpp"
#include "messages.hpp"

#include <fathom/dof_masks.hpp>
#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/linearize.hpp>
#include <fathom/picture.hpp>

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include <cmath>

namespace fathom::cli {
namespace {

constexpr const char* relative_group = "Relative depth";
constexpr double little_range = 0.1; // of 0 to 1

// Two numbers "A,B"; nothing otherwise.
std::optional<std::array<double, 2>> two_numbers(const std::string& text) {
    const std::vector<std::string> parts = CLI::detail::split(text, ',');
    std::array<double, 2> numbers{};
    bool good = parts.size() == 2;
    for (std::size_t i = 0; good && i < 2; ++i)
        good = CLI::detail::lexical_cast(parts[i], numbers[i]) && std::isfinite(numbers[i]);
    return good ? std::optional(numbers) : std::nullopt;
}

CLI::Option* add_two(CLI::App& app, const char* name, const std::function<bool(const std::array<double, 2>&)>& accepted,
                     const std::function<void(const std::array<double, 2>&)>& take, const char* what,
                     const char* description) {
    const auto check = [=](std::string& text) {
        const auto numbers = two_numbers(text);
        return numbers && accepted(*numbers) ? std::string() : "'" + text + "' will not do; it is " + what;
    };
    return app
        .add_option_function<std::string>(
            name, [take](const std::string& text) { take(*two_numbers(text)); }, description)
        ->type_name("A,B")
        ->check(CLI::Validator(check, ""))
        ->group(relative_group);
}

} // namespace

void add_relative_options(CLI::App& app, RelativeOptions& relative) {
    CLI::Option* order =
        app.add_option_function<std::string>(
               "--relative",
               [&relative](const std::string& text) {
                   relative.order = text == "high-is-near" ? RelativeOrder::high_is_near : RelativeOrder::low_is_near;
               },
               "the depth has no unit and needs no camera: 8 or 16 bits, or\n"
               "floats, as neural networks give it. Says which values are near")
            ->type_name("high-is-near|low-is-near")
            ->check(is_one_of({"high-is-near", "low-is-near"}))
            ->group(relative_group);
    for (const char* other : {"--camera", "--preset", "--image", "--node", "--undistorted", "--focus", "--focus-along",
                              "--f-stop", "--focal-length-mm", "--sensor-mm", "--mm-per-unit", "--circle"})
        order->excludes(other);
    app.add_option("--blur-px", relative.blur_px,
                   "circle, in pixels, where the depth is 1 more or less than at\nthe focus, of 0 to 1")
        ->type_name("N")
        ->check(is_a_number("number from 0", [](double n) { return n >= 0; }))
        ->needs(order)
        ->group(relative_group);
    add_two(
        app, "--focus-range", [](const auto& n) { return n[0] >= 0 && n[0] <= n[1] && n[1] <= 1; },
        [&relative](const auto& n) {
            relative.focus_range = FocusRange{n[0], n[1]};
        },
        "two numbers A,B with 0 <= A <= B <= 1", "all of these values are in focus, instead of --focus-at")
        ->needs(order)
        ->excludes("--focus-at");
    add_two(
        app, "--relative-range", [](const auto& n) { return n[0] < n[1]; },
        [&relative](const auto& n) { relative.range = n; }, "two numbers A,B with A < B",
        "stored values that are 0 and 1 (default: floats' own least and\ngreatest; all that integers can hold)")
        ->needs(order);
}

void check_relative(const RelativeOptions& relative, const LensOptions& lens) {
    if (!relative.blur_px)
        throw UsageError(
            "--blur-px: missing; say with it how many pixels wide the largest blur is, as in --blur-px 24");
    if (!lens.focus_at && !relative.focus_range)
        throw UsageError(
            "--focus-at: missing; say with --focus-at X,Y which pixel is in focus, or with --focus-range A,B "
            "which values are");
}

RelativeDepth relative_depth(const RelativeOptions& relative, const Job& job, const std::string& channel) {
    RelativeDepth result;
    {
        const StderrSilenced silenced;
        result.input = io::read_relative_input(job.input, {.channel = channel, .range = relative.range});
    }
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
        cv::Mat color;
        {
            const StderrSilenced silenced;
            color = read_picture(file, {.layer = relative.color_layer, .encoding = {}}).color;
        }
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

namespace {

// The lens for an input whose own camera may complete it.
LensOptions lens_of(LensOptions lens, const Job& job) {
    if (job.own_camera)
        complete(lens, *job.own_camera, (job.camera_file.empty() ? job.input : job.camera_file).native());
    return lens;
}

CircleOfConfusion relative_circle_for(const RelativeOptions& relative, const StoredDepth& stored,
                                      const LensOptions& lens) {
    if (!lens.focus_at)
        return relative_circle(*relative.blur_px, relative.focus_range->low, *relative.order);
    const auto [x, y] = *lens.focus_at;
    if (x < 0 || y < 0 || x >= stored.camera.width || y >= stored.camera.height)
        throw Error(fmt::format("--focus-at: pixel {},{} lies outside the image of {} × {}; the last one is {},{}", x,
                                y, stored.camera.width, stored.camera.height, stored.camera.width - 1,
                                stored.camera.height - 1));
    double z = 0;
    try {
        z = depth_at(stored, x, y);
    } catch (const std::invalid_argument&) {
        throw Error(fmt::format("--focus-at: pixel {},{} has no depth; choose one that has", x, y));
    }
    return relative_circle(*relative.blur_px, *relative.order == RelativeOrder::high_is_near ? 1 - z : z,
                           *relative.order);
}

} // namespace

CircleOfConfusion circle_of(const RelativeOptions& relative, const LensOptions& lens, const StoredDepth& stored,
                            const Job& job) {
    return relative.order ? relative_circle_for(relative, stored, lens)
                          : circle_for(lens_of(lens, job), stored, job.windows);
}

std::vector<std::string> blur_doubts(const RelativeOptions& relative, const LensOptions& lens,
                                     const StoredDepth& stored, const Job& job, const Look& look, Sky sky,
                                     double max_coc_px) {
    const CircleOfConfusion circle = circle_of(relative, lens, stored, job);
    if (!relative.order)
        return lens_doubts(lens_of(lens, job), circle, look, sky, max_coc_px);
    if (relative.focus_range)
        return {}; // all may be in focus
    return circle_doubts(circle, look, sky, max_coc_px, fmt::format("--blur-px is {}", number(*relative.blur_px)));
}

} // namespace fathom::cli
