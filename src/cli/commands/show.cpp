// fathom show
#include "camera_file/file.hpp"
#include "cli/command.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/show/false_color.hpp"
#include "io/formats.hpp"
#include "io/replace_files.hpp"
#include "sequence/frame_pattern.hpp"
#include "shot/inputs.hpp"
#include "shot/plan.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <map>
#include <memory>
#include <string_view>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

struct ShowArguments {
    Inputs files;
    std::string output, channel, unit;
    RangeWish range;
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

// What was asked for and the file has no use for.
void check_wishes(const ShowArguments& options, const fs::path& file, const Viewed& viewed) {
    if (viewed.kind == Viewed::Kind::values)
        return;
    const char* held = viewed.kind == Viewed::Kind::normals ? "normals" : "a picture";
    if (options.range.ends || options.range.scale)
        throw Error(fmt::format("{}: holds {}, which have no range; leave --range and --scale out, or name one channel "
                                "with --channel",
                                file.native(), held));
}

void announce(const ShowArguments& options, const ToShow& shot, const cv::Mat& picture, const Viewed& viewed,
              const Statistics& found, const ColorRange& range) {
    const bool values = viewed.kind == Viewed::Kind::values;
    const auto end = [&](double value) { return found.any() ? json_number(value) : nlohmann::ordered_json(); };
    if (options.json) {
        nlohmann::ordered_json line{{"input", shot.file.native()}, {"output", shot.output.native()},
                                    {"width", picture.cols},       {"height", picture.rows},
                                    {"shows", viewed.name},        {"pixels", found.pixels},
                                    {"invalid", found.invalid},    {"background", found.background}};
        if (values)
            line.update({{"min", end(found.least)},
                         {"max", end(found.greatest)},
                         {"range", {range.low, range.high}},
                         {"scale", to_string(range.scale)},
                         {"map", to_string(options.map)}});
        print_json(line);
        return;
    }
    std::string what = io::printable(viewed.name);
    if (values && found.any())
        what += fmt::format(" {} to {}, {} from {} to {}, {} scale", number(found.least), number(found.greatest),
                            to_string(options.map), number(range.low), number(range.high), to_string(range.scale));
    else if (values)
        what += ": no finite value";
    if (found.background > 0)
        what += fmt::format(", {} background", found.background);
    fmt::print("{}  {} × {}  {}, {}\n", io::printable(shot.output.native()), viewed.image.cols, viewed.image.rows, what,
               invalid_in_words(found.invalid, found.pixels));
}

void show(const ShowArguments& options, const ToShow& shot) {
    Viewed viewed = read_viewed(shot.file, options.channel);
    check_wishes(options, shot.file, viewed);
    if (!options.unit.empty())
        viewed.unit = options.unit;
    const Statistics found = statistics_of(viewed);
    const ColorRange range = choose_range(found, viewed.from_0_to_1, options.range);
    if (const std::string fault = range.fault(); !fault.empty())
        throw Error(shot.file.native() + ": " + fault);
    cv::Mat picture = false_color(viewed, range, options.map);
    if (options.legend && viewed.kind != Viewed::Kind::picture)
        picture = with_legend(picture, viewed, found, range, options.map);
    const io::NewFile file{shot.output, io::png_bytes(picture)};
    if (std::error_code told_by_writing; options.files.is_sequence() || options.output.ends_with('/'))
        fs::create_directories(shot.output.parent_path(), told_by_writing);
    io::replace_files({&file, 1});
    announce(options, shot, picture, viewed, found, range);
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

// MIN:MAX into a wish; false for anything else.
bool take_range(const std::string& text, RangeWish& wish) {
    const std::size_t colon = text.find(':');
    double low = 0, high = 0;
    if (colon == std::string::npos || !CLI::detail::lexical_cast(text.substr(0, colon), low) ||
        !CLI::detail::lexical_cast(text.substr(colon + 1), high))
        return false;
    wish.ends = {low, high};
    return ColorRange{ColorScale::linear, low, high}.fault().empty();
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
                return take_range(text, options->range)
                           ? std::string()
                           : "'" + text + "' will not do; it is MIN:MAX, two finite numbers that ascend, as in 0.5:12";
            },
            ""))
        ->group("Output");
    const auto set_scale = [options](const std::string& text) {
        for (const ColorScale scale : {ColorScale::linear, ColorScale::logarithmic, ColorScale::inverse})
            if (text == to_string(scale))
                options->range.scale = scale;
    };
    add_option(app, "Output", "--scale", "auto|linear|log|inverse", set_scale,
               "between them: linear, by the logarithm, or by 1 / value\n(default: auto, the "
               "one that uses the colours most "
               "evenly)")
        ->check(is_one_of({"auto", "linear", "log", "inverse"}));
    add_map_option(app, options->map);
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
