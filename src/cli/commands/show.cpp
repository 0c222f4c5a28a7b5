// fathom show
#include "camera_file/file.hpp"
#include "cli/command.hpp"
#include "cli/options/depth_options.hpp"
#include "description/operations.hpp"
#include "io/formats.hpp"
#include "io/replace_files.hpp"
#include "sequence/frames.hpp"
#include "shot/inputs.hpp"
#include "shot/plan.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>
#include <fathom/io.hpp>
#include <fathom/picture.hpp>

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

enum class ColorMap { viridis, turbo, grey };
enum class ColorScale { linear, log, inverse };
constexpr const char *map_names[] = {"viridis", "turbo", "grey"}, *scale_names[] = {"linear", "log", "inverse"};

struct ShowArguments {
    Inputs files;
    std::string output, channel, unit;
    std::optional<std::array<double, 2>> range;
    ColorScale scale = ColorScale::linear;
    ColorMap map = ColorMap::viridis;
    bool legend = true, json = false;
};

constexpr std::string_view own_ending = ".show.png";

// The pictures of earlier runs in a folder are no results.
std::vector<Input> shown_files(const ShowArguments& options) {
    std::vector<Input> files = options.files.all();
    std::erase_if(files, [](const Input& each) { return each.source && each.file.ends_with(own_ending); });
    if (files.empty())
        throw Error(options.files.arguments.front() + ": holds pictures of fathom show only; name the results");
    return files;
}

fs::path output_of(const ShowArguments& options, const Input& input) {
    if (options.output.empty())
        return fs::path(input.file).replace_extension(own_ending);
    if (options.output.ends_with('/') || io::is_folder(options.output))
        return fs::path(options.output) / fs::path(input.file).stem().concat(".png");
    if (extension_of(options.output) != ".png")
        throw UsageError(options.output + ": the picture is a PNG; give a name that ends with .png");
    if (!options.files.is_sequence())
        return options.output;
    const auto pattern = sequence::FramePattern::in(options.output);
    if (!pattern)
        throw UsageError(options.output + ": several files cannot go into one picture; give a folder, or a name with "
                                          "the place of the frame, as in ao.####.png");
    if (!input.frame)
        throw UsageError(input.file + ": its name holds no frame, which -o " + options.output +
                         " needs; give a folder");
    return pattern->name(*input.frame);
}

struct ToShow {
    fs::path file, output;
};

// What is wrong for all is told before the first is read.
std::vector<ToShow> all_to_show(const ShowArguments& options) {
    std::vector<ToShow> all;
    std::map<fs::path, std::string> taken;
    for (const Input& input : shown_files(options)) {
        const fs::path output = output_of(options, input);
        if (io::is_same(input.file, output))
            throw UsageError(output.native() + ": is the file to show; give another name for its picture");
        const auto [first, is_new] = taken.emplace(output, input.file);
        if (!is_new)
            throw UsageError(fmt::format("{}: would be the picture of {} and of {}; show them one by one",
                                         output.native(), first->second, input.file));
        all.push_back({input.file, output});
    }
    return all;
}

/// An image for people to look at, as its file holds it.
struct Viewed {
    enum class Kind { values, normals, picture };

    Kind kind = Kind::values;
    cv::Mat image;            ///< CV_32FC1 values; CV_32FC3 vectors x, y, z; CV_32FC3 or 4 in linear light, B, G, R
    std::string name = {};    ///< of the channel or the layer; of files without names what the values are
    std::string unit = {};    ///< where the name says it
    bool from_0_to_1 = false; ///< does the name say so?
};

cv::Mat floats(const cv::Mat& image) {
    cv::Mat converted;
    image.convertTo(converted, CV_32F);
    return converted;
}

Viewed normals_of(const fs::path& file, const std::string& layer) {
    return {Viewed::Kind::normals, read_normals(file, layer), layer.empty() ? "normals" : layer};
}

Viewed picture_in(const fs::path& file, const std::string& layer) {
    return {Viewed::Kind::picture, read_picture(file, {.layer = layer}).color, layer.empty() ? "R, G, B" : layer};
}

Viewed values_of(const fs::path& file, const std::string& channel) {
    const DepthFile read = read_depth(file, {.channel = channel});
    return {Viewed::Kind::values, floats(read.values), read.channel};
}

// Of the program's own results in an EXR those that were made last are looked for first: positions and depth come behind what is
// made of them. `wanted`: only this channel.
std::optional<Viewed> own_result(const fs::path& file, const std::vector<Channel>& channels,
                                 const std::string& wanted) {
    const std::vector<description::Operation>& all = description::operations();
    for (auto operation = all.rbegin(); operation != all.rend(); ++operation)
        for (const description::Result& result : operation->results_of(operation->make(nullptr).get(), {})) {
            const description::Content& content = result.content;
            const std::string names = content.channels, channel = names.substr(names.rfind(' ') + 1);
            const bool fractions = content.of == description::Content::Of::fractions;
            if ((!fractions && content.of != description::Content::Of::lengths) ||
                (!wanted.empty() && channel != wanted) ||
                std::ranges::find(channels, channel, &Channel::name) == channels.end())
                continue;
            Viewed viewed = values_of(file, channel);
            viewed.unit = content.unit;
            viewed.from_0_to_1 = fractions;
            return viewed;
        }
    return std::nullopt;
}

Viewed from_exr(const fs::path& file, const std::vector<Channel>& channels, const std::string& wanted) {
    const auto has = [&](const std::string& name) {
        return std::ranges::find(channels, name, &Channel::name) != channels.end();
    };
    if (has(wanted + ".R"))
        return picture_in(file, wanted);
    if (has(wanted + ".X")) {
        if (auto normals = io::if_any([&] { return normals_of(file, wanted); }))
            return *normals;
        io::refuse(file, fmt::format("layer \"{0}\" has three values a pixel, which are no normals; show one of them: "
                                     "--channel {0}.X, {0}.Y or {0}.Z",
                                     wanted));
    }
    if (auto result = own_result(file, channels, wanted))
        return *result;
    if (!wanted.empty())
        return values_of(file, wanted);
    if (has("N.X"))
        return normals_of(file, "N");
    if (!io::depth_channels(file).empty())
        return values_of(file, "");
    if (auto picture = io::if_any([&] { return picture_in(file, ""); }))
        return *picture;
    if (auto normals = io::if_any([&] { return normals_of(file, ""); }))
        return *normals;
    if (channels.size() == 1)
        return values_of(file, channels.front().name);
    io::refuse(file, "has no channel that says what it is; name one or its layer with --channel: " +
                         io::listed(channels, &Channel::name));
}

Viewed read_viewed(const fs::path& file, const std::string& wanted) {
    if (const std::vector<Channel> channels = list_channels(file); !channels.empty())
        return from_exr(file, channels, wanted);
    io::check_readable(file);
    if (!wanted.empty())
        io::refuse_layer(file, wanted);
    const std::optional<cv::Mat> image = io::within_memory(file, [&] { return io::read_plain(file); });
    if (image && image->channels() == 1)
        return {Viewed::Kind::values, floats(*image),
                image->depth() == CV_8U    ? "codes of 8 bits"
                : image->depth() == CV_16U ? "codes of 16 bits"
                                           : "stored values"};
    double least = 0;
    if (image && image->depth() == CV_32F)
        cv::minMaxLoc(image->reshape(1), &least);
    if (least < 0) // light has no negative values
        if (auto normals = io::if_any([&] { return normals_of(file, ""); }))
            return *normals;
    return picture_in(file, "");
}

/// What an image holds, and where its values lie on the map: from `low` to `high`.
struct Shown {
    cv::Mat invalid, background;    ///< not 0 where pixels are
    std::vector<float> values = {}; ///< finite ones, ascending
    double low = 0, high = 1;
    ColorScale scale = ColorScale::linear;

    double place(double value) const {
        if (scale == ColorScale::linear)
            return (value - low) / (high - low);
        if (value <= 0)
            return 0;
        return scale == ColorScale::log ? std::log(value / low) / std::log(high / low)
                                        : (1 / low - 1 / value) / (1 / low - 1 / high);
    }
};

bool is_range(double low, double high) {
    return std::isfinite(low) && std::isfinite(high) && low < high;
}

// The ends are the least and the greatest value, or where few of them stretch the range to three times of what the others have, those
// of all but 1 %.
Shown look_at(const Viewed& viewed, const ShowArguments& options) {
    Shown shown{.invalid = cv::Mat::zeros(viewed.image.size(), CV_8U),
                .background = cv::Mat::zeros(viewed.image.size(), CV_8U)};
    const bool has_values = viewed.kind == Viewed::Kind::values;
    for (int y = 0; y < viewed.image.rows; ++y)
        for (int x = 0; x < viewed.image.cols; ++x) {
            const float* pixel = viewed.image.ptr<float>(y) + std::ptrdiff_t{x} * viewed.image.channels();
            const bool is_whole =
                std::all_of(pixel, pixel + viewed.image.channels(), [](float value) { return std::isfinite(value); });
            const bool is_background = has_values && pixel[0] == INFINITY;
            shown.background.at<bool>(y, x) = is_background;
            shown.invalid.at<bool>(y, x) =
                (!is_whole && !is_background) ||
                (viewed.kind == Viewed::Kind::normals && pixel[0] == 0 && pixel[1] == 0 && pixel[2] == 0);
            if (has_values && is_whole)
                shown.values.push_back(pixel[0]);
        }
    std::ranges::sort(shown.values);
    shown.scale = options.scale;
    if (options.range) {
        std::tie(shown.low, shown.high) = std::pair((*options.range)[0], (*options.range)[1]);
    } else if ((!viewed.from_0_to_1 || shown.scale != ColorScale::linear) && !shown.values.empty()) {
        const auto at = [&](double fraction) {
            return double{shown.values[std::size_t(std::round(fraction * double(shown.values.size() - 1)))]};
        };
        const bool stretched = at(0.995) > at(0.005) && at(1) - at(0) > 3 * (at(0.995) - at(0.005));
        shown.low = stretched ? at(0.005) : at(0);
        shown.high = stretched ? at(0.995) : at(1);
        if (shown.low == shown.high) { // so that every value has a place
            const double half = shown.low == 0 ? 0.5 : std::abs(shown.low) / 2;
            shown.low -= half;
            shown.high += half;
        }
    }
    if (!shown.values.empty() && shown.scale != ColorScale::linear && !(shown.low > 0))
        throw Error(fmt::format("a {} scale needs values above 0, and the range begins at {}; give --range, or --scale "
                                "linear",
                                scale_names[int(shown.scale)], number(shown.low)));
    return shown;
}

cv::Mat colors_of(const cv::Mat& codes, ColorMap map) {
    cv::Mat colors;
    if (map == ColorMap::grey)
        cv::cvtColor(codes, colors, cv::COLOR_GRAY2BGR);
    else
        cv::applyColorMap(codes, colors, map == ColorMap::turbo ? cv::COLORMAP_TURBO : cv::COLORMAP_VIRIDIS);
    return colors;
}

const cv::Scalar invalid_color(255, 0, 255), background_color(240, 215, 200), ink(32, 32, 32);

cv::Mat false_color(const Viewed& viewed, const Shown& shown, ColorMap map) {
    cv::Mat picture;
    if (viewed.kind == Viewed::Kind::values) {
        cv::Mat_<unsigned char> codes(viewed.image.size());
        std::transform(viewed.image.begin<float>(), viewed.image.end<float>(), codes.begin(), [&](float value) {
            const double code = shown.place(double{value}) * 256;
            return static_cast<unsigned char>(code > 0 ? std::min(code, 255.0) : 0); // 0 for NaN
        });
        picture = colors_of(codes, map);
    } else if (viewed.kind == Viewed::Kind::normals) {
        viewed.image.convertTo(picture, CV_8U, 127.5, 127.5);
        cv::cvtColor(picture, picture, cv::COLOR_RGB2BGR);
    } else {
        cv::Mat light = cv::max(cv::min(viewed.image, cv::Scalar::all(1)), cv::Scalar::all(0));
        io::from_linear(light, ColorEncoding::srgb);
        light.convertTo(picture, CV_8U, 255);
        if (picture.channels() == 4)
            cv::cvtColor(picture, picture, cv::COLOR_BGRA2BGR);
    }
    picture.setTo(invalid_color, shown.invalid);
    picture.setTo(background_color, shown.background);
    return picture;
}

std::string meaning_of(const Viewed& viewed, const Shown& shown) {
    if (viewed.kind == Viewed::Kind::normals)
        return viewed.name + ": (n + 1) / 2, x red, y green, z blue";
    return viewed.name + (viewed.unit.empty() ? "" : " [" + viewed.unit + "]") +
           (shown.scale == ColorScale::linear ? "" : fmt::format(", {} scale", scale_names[int(shown.scale)]));
}

// The picture with a bar of colors below it, its ends and its meaning, and what the marks stand for. A narrow one gets a margin.
cv::Mat with_legend(const cv::Mat& picture, const Viewed& viewed, const Shown& shown, ColorMap map) {
    const int scale = std::max(1, std::min(picture.rows, picture.cols) / 540), line = 18 * scale, pad = 10 * scale,
              width = std::max(picture.cols, 320 * scale), inside = width - 2 * pad;
    const bool has_bar = viewed.kind == Viewed::Kind::values,
               has_marks = cv::countNonZero(shown.invalid) + cv::countNonZero(shown.background) > 0;
    const int lines = (has_bar ? 3 : 1) + (has_marks ? 1 : 0);
    cv::Mat whole(picture.rows + 2 * pad + lines * line, width, CV_8UC3, cv::Scalar::all(250));
    picture.copyTo(whole(cv::Rect((width - picture.cols) / 2, 0, picture.cols, picture.rows)));
    int y = picture.rows + pad;
    const auto draw = [&](const std::string& text, int x, bool ends_there = false) {
        const double size = 0.4 * scale;
        const int wide = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, scale, nullptr).width;
        cv::putText(whole, text, {ends_there ? x - wide : x, y + 12 * scale}, cv::FONT_HERSHEY_SIMPLEX, size, ink,
                    scale, cv::LINE_AA);
        return x + wide;
    };
    if (has_bar) {
        cv::Mat_<unsigned char> codes(1, 256);
        for (int i = 0; i < 256; ++i)
            codes(i) = static_cast<unsigned char>(i);
        cv::Mat place = whole(cv::Rect(pad, y, inside, line - 4 * scale));
        cv::resize(colors_of(codes, map), place, place.size(), 0, 0, cv::INTER_NEAREST);
        y += line;
        draw(number(shown.low), pad);
        draw(number(shown.high), pad + inside, true);
        y += line;
    }
    draw(meaning_of(viewed, shown), pad);
    y += line;
    int x = pad;
    for (const auto& [marked, color, name] :
         {std::tuple(shown.invalid, invalid_color, "invalid"), {shown.background, background_color, "background"}})
        if (const int count = cv::countNonZero(marked); count > 0) {
            whole(cv::Rect(x, y + 2 * scale, 11 * scale, 11 * scale)).setTo(color);
            x = draw(fmt::format("{} {}", count, name), x + 16 * scale) + 16 * scale;
        }
    return whole;
}

void announce(const ShowArguments& options, const ToShow& shot, const cv::Mat& picture, const Viewed& viewed,
              const Shown& shown) {
    const bool values = viewed.kind == Viewed::Kind::values, any = !shown.values.empty();
    const double least = any ? double{shown.values.front()} : 0, greatest = any ? double{shown.values.back()} : 0;
    const auto invalid = std::size_t(cv::countNonZero(shown.invalid));
    const int background = cv::countNonZero(shown.background);
    if (options.json) {
        nlohmann::ordered_json line{{"input", shot.file.native()}, {"output", shot.output.native()},
                                    {"width", picture.cols},       {"height", picture.rows},
                                    {"shows", viewed.name},        {"pixels", viewed.image.total()},
                                    {"invalid", invalid},          {"background", background}};
        if (values)
            line.update({{"min", any ? json_number(least) : nlohmann::ordered_json()},
                         {"max", any ? json_number(greatest) : nlohmann::ordered_json()},
                         {"range", {shown.low, shown.high}},
                         {"scale", scale_names[int(shown.scale)]},
                         {"map", map_names[int(options.map)]}});
        print_json(line);
        return;
    }
    std::string what = io::printable(viewed.name);
    if (values && any)
        what += fmt::format(" {} to {}, {} from {} to {}, {} scale", number(least), number(greatest),
                            map_names[int(options.map)], number(shown.low), number(shown.high),
                            scale_names[int(shown.scale)]);
    else if (values)
        what += ": no finite value";
    if (background > 0)
        what += fmt::format(", {} background", background);
    fmt::print("{}  {} × {}  {}, {}\n", io::printable(shot.output.native()), viewed.image.cols, viewed.image.rows, what,
               invalid_in_words(invalid, viewed.image.total()));
}

void show(const ShowArguments& options, const ToShow& shot) {
    Viewed viewed = read_viewed(shot.file, options.channel);
    if (viewed.kind != Viewed::Kind::values && (options.range || options.scale != ColorScale::linear))
        io::refuse(shot.file, fmt::format("holds {}, which have no range; leave --range and --scale out, or name one "
                                          "channel with --channel",
                                          viewed.kind == Viewed::Kind::normals ? "normals" : "pictures"));
    if (!options.unit.empty())
        viewed.unit = options.unit;
    Shown shown;
    try {
        shown = look_at(viewed, options);
    } catch (const Error& error) {
        io::refuse(shot.file, error.what());
    }
    cv::Mat picture = false_color(viewed, shown, options.map);
    if (options.legend && viewed.kind != Viewed::Kind::picture)
        picture = with_legend(picture, viewed, shown, options.map);
    const io::NewFile file{shot.output, io::png_bytes(picture)};
    if (std::error_code told_by_writing; options.files.is_sequence() || options.output.ends_with('/'))
        fs::create_directories(shot.output.parent_path(), told_by_writing);
    io::replace_files({&file, 1});
    announce(options, shot, picture, viewed, shown);
}

int show(const ShowArguments& options) {
    int code = done;
    for (const ToShow& shot : all_to_show(options))
        try {
            show(options, shot);
        } catch (const Error& error) {
            complain(error.what());
            code = input_failed;
        }
    return code;
}

// MIN:MAX; false for anything else.
bool take_range(const std::string& text, ShowArguments& options) {
    const std::size_t colon = text.find(':');
    double low = 0, high = 0;
    if (colon == std::string::npos || !CLI::detail::lexical_cast(text.substr(0, colon), low) ||
        !CLI::detail::lexical_cast(text.substr(colon + 1), high))
        return false;
    options.range = {low, high};
    return is_range(low, high);
}

std::function<int()> configure_show(CLI::App& app) {
    auto options = std::make_shared<ShowArguments>();
    add_option(app, "Input", "FILE", "FILE", options->files.arguments,
               "results or depth images: EXR, PNG, TIFF, PFM, NPY, PGM or HDR.\nAlso a folder, or "
               "'ao.####.exr', 'ao.%04d.exr' or 'ao.*.exr'")
        ->required();
    add_option(app, "Input", "--channel", "NAME", options->channel,
               "EXR channel or layer to show (default: the result's own, or\nnormals, depth, a picture)");
    add_option(app, "Output", "-o,--output", "PICTURE.png", options->output,
               "PNG to write, a folder, or ao.####.png\n(default: FILE with .show.png for its extension)");
    app.add_option("--range", "values at the ends of the map (default: the least and the\ngreatest, without rare ones)")
        ->type_name("MIN:MAX")
        ->check(CLI::Validator(
            [options](std::string& text) {
                return take_range(text, *options)
                           ? std::string()
                           : "'" + text + "' will not do; it is MIN:MAX, two finite numbers that ascend, as in 0.5:12";
            },
            ""))
        ->group("Output");
    add_enum_option(app, "--scale", options->scale,
                    {{"linear", ColorScale::linear}, {"log", ColorScale::log}, {"inverse", ColorScale::inverse}},
                    "between them (default: linear), by the logarithm, or by 1 / value")
        ->group("Output");
    add_enum_option(app, "--map", options->map,
                    {{"viridis", ColorMap::viridis}, {"turbo", ColorMap::turbo}, {"grey", ColorMap::grey}},
                    "colours of values (default: viridis, whose steps look equal)")
        ->group("Output");
    add_option(app, "Output", "--unit", "NAME", options->unit, "unit of the values, for the legend");
    app.add_flag_callback(
           "--no-legend", [options] { options->legend = false; }, "the picture alone, a pixel for each pixel")
        ->group("Output");
    app.add_flag("--json", options->json, "print a line of JSON")->group("Report");
    return [options] { return show(*options); };
}

} // namespace

extern const Command show_command{
    "show", "Writes pictures of results or of depth in false colour.",
    R"(Values have the colours of the map, with a bar below that says what they mean. Normals are ½n + ½, pictures sRGB.
Invalid pixels are magenta, and background (+infinity) is pale blue.

Example:
  fathom show ao.0001.exr -o ao.png --range 0:1)",
    configure_show};

} // namespace fathom::cli
