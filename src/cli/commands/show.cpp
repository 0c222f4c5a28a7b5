// fathom show
#include "cli/options.hpp"
#include "io/replace_files.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <numeric>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

constexpr int grey = -1; // no map of OpenCV's

struct ShowArguments {
    DepthOptions files; ///< inputs and output
    std::string channel, unit;
    std::optional<std::array<double, 2>> range;
    int map = cv::COLORMAP_VIRIDIS;
    bool no_legend = false, json = false;
};

/// An image for people to look at.
struct Viewed {
    enum class Kind { values, normals, picture };

    Kind kind = Kind::values;
    cv::Mat image;         ///< CV_32FC1 values; CV_32FC3 vectors x, y, z; CV_32FC3 or 4 in linear light, B, G, R
    std::string name = {}; ///< of the channel or the layer; of files without names what the values are
    std::string unit = {};
    cv::Mat invalid = {}, background = {}; ///< not 0 where pixels are
    std::vector<float> values = {};        ///< finite ones, ascending
    double low = 0, high = 1;              ///< the values at the ends of the map
};

Viewed normals_of(const fs::path& file, const std::string& layer) {
    return {Viewed::Kind::normals, read_normals(file, layer), layer.empty() ? "normals" : layer};
}

Viewed picture_in(const fs::path& file, const std::string& layer) {
    return {Viewed::Kind::picture, read_picture(file, {.layer = layer}).color, layer.empty() ? "R, G, B" : layer};
}

// What the program's operations write into a channel that is a number by itself; none where they do not.
std::optional<description::Content> content_of(const std::string& channel) {
    for (const description::Operation& operation : description::operations())
        for (const description::Result& result : operation.results_of(operation.make(nullptr).get(), {}))
            if (std::string(" ").append(result.content.channels).ends_with(" " + channel) &&
                (result.content.of == description::Content::Of::fractions ||
                 result.content.of == description::Content::Of::lengths))
                return result.content;
    return std::nullopt;
}

// The ends of the map are 0 and 1 for fractions, or else the least and the greatest value, or where few of them stretch the range to
// three times of what the others have, those of all but 1 %.
Viewed values_of(const cv::Mat& values, const std::string& name) {
    Viewed viewed{.image = {}, .name = name};
    values.convertTo(viewed.image, CV_32F);
    for (const float value : cv::Mat_<float>(viewed.image))
        if (std::isfinite(value))
            viewed.values.push_back(value);
    std::ranges::sort(viewed.values);
    const auto content = content_of(name);
    if (content)
        viewed.unit = content->unit;
    if (viewed.values.empty() || (content && content->of == description::Content::Of::fractions))
        return viewed;
    const auto at = [&](double fraction) {
        return double{viewed.values[std::size_t(std::round(fraction * double(viewed.values.size() - 1)))]};
    };
    const bool stretched = at(0.995) > at(0.005) && at(1) - at(0) > 3 * (at(0.995) - at(0.005));
    viewed.low = stretched ? at(0.005) : at(0);
    viewed.high = stretched ? at(0.995) : at(1);
    if (viewed.low == viewed.high) { // so that every value has a place
        viewed.low -= 0.5;
        viewed.high += 0.5;
    }
    return viewed;
}

Viewed channel_of(const fs::path& file, const std::string& channel) {
    const DepthFile read = read_depth(file, {.channel = channel});
    return values_of(read.values, read.channel);
}

// Of the channels of an EXR a result comes before the depth that it is of.
Viewed from_exr(const fs::path& file, const std::vector<Channel>& channels, const std::string& wanted) {
    const auto has = [&](const std::string& name) {
        return std::ranges::find(channels, name, &Channel::name) != channels.end();
    };
    if (has(wanted + ".R"))
        return picture_in(file, wanted);
    if (has(wanted + ".X"))
        return normals_of(file, wanted);
    if (!wanted.empty())
        return channel_of(file, wanted);
    const std::vector<std::string> depth = io::depth_channels(file);
    for (const Channel& channel : channels)
        if (channel.name.find('.') == std::string::npos && content_of(channel.name) &&
            std::ranges::find(depth, channel.name) == depth.end())
            return channel_of(file, channel.name);
    if (has("N.X"))
        return normals_of(file, "N");
    if (depth.empty())
        if (auto picture = io::if_any([&] { return picture_in(file, ""); }))
            return *picture;
    return channel_of(file, "");
}

Viewed read_viewed(const fs::path& file, const std::string& wanted) {
    if (const std::vector<Channel> channels = list_channels(file); !channels.empty())
        return from_exr(file, channels, wanted);
    if (!wanted.empty())
        io::refuse_layer(file, wanted);
    const cv::Mat image = io::within_memory(file, [&] {
        return io::read_image(file, {"a result", ".exr, .png, .tif, .pfm, .npy, .pgm, .jpg and .hdr", true}).image;
    });
    if (image.channels() == 1)
        return values_of(image, image.depth() == CV_32F ? "stored values" : "codes");
    double least = 0;
    if (image.depth() == CV_32F)
        cv::minMaxLoc(image.reshape(1), &least);
    if (least < 0) // light has no negative values
        if (auto normals = io::if_any([&] { return normals_of(file, ""); }))
            return *normals;
    return picture_in(file, "");
}

void find_marked(Viewed& viewed) {
    cv::inRange(viewed.image, cv::Scalar::all(-FLT_MAX), cv::Scalar::all(FLT_MAX), viewed.invalid);
    cv::bitwise_not(viewed.invalid, viewed.invalid);
    viewed.background = cv::Mat::zeros(viewed.image.size(), CV_8U);
    if (viewed.kind == Viewed::Kind::values)
        viewed.background = viewed.image == INFINITY;
    cv::Mat none = viewed.background.clone();
    if (viewed.kind == Viewed::Kind::normals)
        cv::inRange(viewed.image, cv::Scalar::all(0), cv::Scalar::all(0), none);
    viewed.invalid ^= none; // the background is counted by itself
}

cv::Mat colors_of(const cv::Mat& codes, int map) {
    cv::Mat colors;
    if (map == grey)
        cv::cvtColor(codes, colors, cv::COLOR_GRAY2BGR);
    else
        cv::applyColorMap(codes, colors, map);
    return colors;
}

cv::Mat false_color(const Viewed& viewed, int map) {
    cv::Mat picture;
    if (viewed.kind == Viewed::Kind::values) {
        cv::Mat_<unsigned char> codes(viewed.image.size());
        std::transform(viewed.image.begin<float>(), viewed.image.end<float>(), codes.begin(), [&](float value) {
            const double code = (double{value} - viewed.low) / (viewed.high - viewed.low) * 256;
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
    picture.setTo(cv::Scalar(255, 0, 255), viewed.invalid);
    picture.setTo(cv::Scalar(240, 215, 200), viewed.background);
    return picture;
}

// The picture, and below it its name, for values between the ends of a bar of colors. A narrow one gets a margin.
cv::Mat with_legend(const cv::Mat& picture, const Viewed& viewed, int map) {
    const int scale = std::max(1, std::min(picture.rows, picture.cols) / 540), line = 18 * scale, pad = 10 * scale,
              width = std::max(picture.cols, 320 * scale), inside = width - 2 * pad, lines = 2 * line;
    cv::Mat whole(picture.rows + 2 * pad + lines, width, CV_8UC3, cv::Scalar::all(250));
    picture.copyTo(whole(cv::Rect((width - picture.cols) / 2, 0, picture.cols, picture.rows)));
    const auto draw = [&](const std::string& text, double part) { // of the width, which is left of it
        const double size = 0.4 * scale;
        const int wide = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, scale, nullptr).width;
        const cv::Point place(pad + int(part * (inside - wide)), picture.rows + pad + line + 12 * scale);
        cv::putText(whole, text, place, cv::FONT_HERSHEY_SIMPLEX, size, cv::Scalar::all(32), scale, cv::LINE_AA);
    };
    if (viewed.kind == Viewed::Kind::normals) {
        draw(viewed.name + ": (n + 1) / 2, x red, y green, z blue", 0);
        return whole;
    }
    cv::Mat_<unsigned char> codes(1, 256);
    std::iota(codes.begin(), codes.end(), static_cast<unsigned char>(0));
    cv::Mat bar = whole(cv::Rect(pad, picture.rows + pad, inside, line - 4 * scale));
    cv::resize(colors_of(codes, map), bar, bar.size(), 0, 0, cv::INTER_NEAREST);
    draw(number(viewed.low), 0);
    draw(viewed.name + (viewed.unit.empty() ? "" : " [" + viewed.unit + "]"), 0.5);
    draw(number(viewed.high), 1);
    return whole;
}

void announce(const ShowArguments& options, const Job& job, const Viewed& viewed) {
    const auto invalid = std::size_t(cv::countNonZero(viewed.invalid));
    const std::string output = job.outputs.front().native();
    if (options.json) {
        ordered_json line{{"input", job.input.native()},
                          {"output", output},
                          {"shows", viewed.name},
                          {"invalid", invalid},
                          {"background", cv::countNonZero(viewed.background)}};
        if (!viewed.values.empty())
            line.update({{"min", json_number(double{viewed.values.front()})},
                         {"max", json_number(double{viewed.values.back()})},
                         {"range", {viewed.low, viewed.high}}});
        return print_json(line);
    }
    std::string what = viewed.name;
    if (!viewed.values.empty())
        what += fmt::format(" {} to {}", number(double{viewed.values.front()}), number(double{viewed.values.back()}));
    else if (viewed.kind == Viewed::Kind::values)
        what += ": no finite value";
    fmt::print("{}  {} × {}  {}, {}\n", io::printable(output), viewed.image.cols, viewed.image.rows,
               io::printable(what), invalid_in_words(invalid, viewed.image.total()));
}

void show(const ShowArguments& options, const Job& job) {
    if (!job.missing.empty())
        throw Error(fmt::format("{}: is not there any more; run it again", job.missing.native()));
    Viewed viewed = read_viewed(job.input, options.channel);
    find_marked(viewed);
    if (options.range && viewed.kind != Viewed::Kind::values)
        io::refuse(job.input, "holds normals or a picture, which have no range; leave --range out, or give --channel");
    if (options.range)
        std::tie(viewed.low, viewed.high) = std::pair((*options.range)[0], (*options.range)[1]);
    if (!options.unit.empty())
        viewed.unit = options.unit;
    cv::Mat picture = false_color(viewed, options.map);
    if (!options.no_legend && viewed.kind != Viewed::Kind::picture)
        picture = with_legend(picture, viewed, options.map);
    prepare_folders(options.files, job);
    const io::NewFile file{job.outputs.front(), io::png_bytes(picture)};
    io::replace_files({&file, 1});
    announce(options, job, viewed);
}

int show(const ShowArguments& options) {
    int code = done;
    for (const Job& job : plan(options.files)) // which tells what is wrong for all
        try {
            show(options, job);
        } catch (const Error& error) {
            complain(error.what());
            code = input_failed;
        }
    return code;
}

// "0.5:12".
std::optional<std::array<double, 2>> range_in(std::string text) {
    std::ranges::replace(text, ':', ',');
    const std::vector<double> ends = numbers_in(text, 2);
    const bool ascend = !ends.empty() && ends[0] < ends[1] && std::isfinite(ends[0]) && std::isfinite(ends[1]);
    return ascend ? std::optional(std::array{ends[0], ends[1]}) : std::nullopt;
}

std::function<int()> configure_show(CLI::App& app) {
    auto options = std::make_shared<ShowArguments>();
    add_option(app, "Input", "FILE", "FILE", options->files.inputs.arguments,
               "results or depth images: EXR, PNG, TIFF, PFM, NPY, PGM or HDR. Also a folder, or "
               "'ao.####.exr', 'ao.%04d.exr' or 'ao.*.exr'")
        ->required();
    add_option(app, "Input", "--channel", "NAME", options->channel,
               "EXR channel or layer to show (default: the result's own, or normals, depth, a picture)");
    add_option(app, "Output", "-o,--output", "PICTURE.png", options->files.output,
               "PNG to write, a folder, or ao.####.png (default: FILE with .show.png for its extension)");
    add_read_option(app, "Output", "--range", "MIN:MAX", options->range, range_in,
                    "MIN:MAX, two finite numbers that ascend, as in 0.5:12",
                    "values at the ends of the map (default: the least and the greatest, without rare ones)");
    add_enum_option(app, "Output", "--map", options->map,
                    {{"viridis", int{cv::COLORMAP_VIRIDIS}}, {"turbo", int{cv::COLORMAP_TURBO}}, {"grey", grey}},
                    "colours of values (default: viridis, whose steps look equal)");
    add_option(app, "Output", "--unit", "NAME", options->unit, "unit of the values, for the legend");
    add_flag(app, "Output", "--no-legend", options->no_legend, "the picture alone, a pixel for each pixel");
    add_flag(app, "Report", "--json", options->json, "print a line of JSON");
    return [options] {
        DepthOptions& files = options->files;
        const bool beside = files.output.empty();
        files.outputs = {{"-o", files.output, {{beside ? show_ending : ".png"}, {}, 1.0}, beside}};
        return show(*options);
    };
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
