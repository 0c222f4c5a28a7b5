// The program's options: those that several commands share, and those of the operations, which their descriptions make.
#include "options.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace fathom::cli {
namespace {

using description::Kind;
using description::Option;
using description::Value;

constexpr description::Range thread_counts = description::whole(1, 4096), scales = description::above(0);

// "8G" as a number of bytes; nothing for what is no size.
std::optional<std::size_t> bytes_of(std::string text) {
    constexpr std::string_view units = "KMGT";
    double factor = 1, number = 0;
    if (const std::size_t unit = text.empty() ? units.npos : units.find(text.back()); unit != units.npos) {
        factor = std::pow(1024.0, static_cast<double>(unit + 1));
        text.pop_back();
    }
    const bool decimal = text.find_first_not_of("0123456789.") == std::string::npos;
    const bool good =
        decimal && CLI::detail::lexical_cast(text, number) && number * factor >= 1 && number * factor < 1e18;
    return good ? std::optional(static_cast<std::size_t>(std::ceil(number * factor))) : std::nullopt;
}

// "1920x1080".
std::optional<cv::Size> size_in(const std::string& text) {
    const std::vector<std::string> sides = CLI::detail::split(text, 'x');
    cv::Size size;
    constexpr int most = 1 << 20;
    const bool good = sides.size() == 2 && CLI::detail::lexical_cast(sides[0], size.width) &&
                      CLI::detail::lexical_cast(sides[1], size.height);
    return good && size.width > 0 && size.height > 0 && size.width <= most && size.height <= most ? std::optional(size)
                                                                                                  : std::nullopt;
}

// "0.3,12".
std::optional<std::array<double, 2>> limits_in(const std::string& text) {
    const std::vector<double> ends = numbers_in(text, 2);
    return !ends.empty() && ends[0] <= ends[1] ? std::optional(std::array{ends[0], ends[1]}) : std::nullopt;
}

// An animated option is given anew for each frame, as if it stood on a command line of its own.

void give(CLI::Option& option, const std::string& value) {
    option.clear();
    option.add_result(value);
    option.run_callback();
}

// What an operation computes may change. Which files there are, and how they are read, may not, but for the range of relative depth.
bool can_change(const CLI::Option& option) {
    static const std::set<std::string> fixed{"Input",  "Picture", "Distance",       "Positions", "Frames", "Output",
                                             "Report", "Device",  "Relative depth", "Options",   "Pipes"};
    return option.get_expected_max() == 1 && !option.get_positional() &&
           (option.get_name() == "--blur-px" || option.get_name() == "--relative-range" ||
            !fixed.contains(option.get_group()));
}

CLI::Option& option_called(CLI::App& app, const std::string& name) {
    std::vector<std::string> known;
    for (CLI::Option* option : app.get_options())
        if (can_change(*option)) {
            known.push_back(option->get_name().substr(2));
            if (known.back() == name)
                return *option;
        }
    if (known.empty())
        throw UsageError(
            fmt::format("--animate: {} has no option that changes from frame to frame; leave it out", app.get_name()));
    throw UsageError(fmt::format("--animate: '{}' is no option that changes from frame to frame; {}", name,
                                 did_you_mean(name, known, "it is " + one_of(known))));
}

Animation animation_of(CLI::App& app, const std::string& text) {
    const std::size_t sign = text.find('=');
    std::string name = text.substr(0, sign);
    name.erase(0, std::min(name.find_first_not_of('-'), name.size()));
    if (sign == std::string::npos || name.empty() || sign + 1 == text.size())
        throw UsageError("--animate: '" + text + "' will not do; it is NAME=FILE, as in focus=focus.csv");
    std::ranges::replace(name, '_', '-');
    CLI::Option& option = option_called(app, name);
    if (option.count() > 0)
        throw UsageError(fmt::format("--animate: {} is given already; give it once", option.get_name()));
    const std::string file = text.substr(sign + 1);
    Animation animation{.option = option.get_name(),
                        .file = file,
                        .values = sequence::read_frame_values(file, name),
                        .give = [&option](const std::string& value) { give(option, value); }};
    for (const auto& [frame, value] : animation.values)
        try {
            animation.give(value);
        } catch (const CLI::ParseError& error) {
            throw Error(fmt::format("{}: frame {}: {}", file, frame, error.what()));
        }
    animation.give(animation.values.begin()->second); // until the first frame says otherwise
    return animation;
}

void add_frame_options(CLI::App& app, DepthOptions& options) {
    add_frames_option(app, options.inputs);
    add_enum_option(app, "Frames", "--missing", options.inputs.skip_missing, {{"error", false}, {"skip", true}},
                    "a frame without its files is an error (default), or is left out (skip)");
    // Every value of the file is parsed and checked as the option itself does it, and the first one stays, so that what depends on
    // the option can be checked before a frame is read.
    CLI::Option* const animate =
        app.add_option_function<std::vector<std::string>>(
               "--animate",
               [&app, &options](const std::vector<std::string>& all) {
                   for (const std::string& each : all)
                       options.animations.push_back(animation_of(app, each));
               },
               "an option whose value changes: FILE holds a line FRAME,VALUE for each frame, or JSON "
               "(docs/sequences.md)")
            ->type_name("NAME=FILE")
            ->allow_extra_args(false)
            ->group("Frames");
    add_flag(app, "Frames", "--interpolate", options.interpolate,
             "fills the frames between two lines of --animate, evenly")
        ->needs(animate);
}

void add_ignore_options(CLI::App& app, DepthOptions& options) {
    CLI::Option* ignore =
        add_option(app, "Input", "--ignore", "FILE", options.ignore,
                   "an image of the depth's size: pixels that are not 0 there do not count, as if they were invalid");
    CLI::Option* below = add_option(
        app, "Input", "--ignore-below", "T", options.ignored_by.below,
        "FILE is an alpha or a confidence: pixels below T do not count. An alpha is 0 to 1; other integers are as "
        "stored, or 0 to 1 if T < 1");
    CLI::Option* above = add_option(app, "Input", "--ignore-above", "T", options.ignored_by.above,
                                    "FILE is an uncertainty: pixels above T do not count");
    for (CLI::Option* option : {below, above})
        option->check(is_in(description::any_number))->needs(ignore);
    above->excludes(below);
    add_enum_option(
        app, "Input", "--edges", options.edges, {{"keep", Edges::keep}, {"sharpen", Edges::sharpen}},
        "sharpen: where depth ramps from one surface to the next over some pixels, as that of a network, averaged "
        "and upsampled depth does, each pixel gets the depth of one of the two, by the picture if there is one; exact "
        "depth stays as it is (default: keep, and sharpen for relative depth)");
    add_read_option(
        app, "Input", "--valid", "MIN,MAX", options.valid, limits_in, "two numbers MIN,MAX with MIN <= MAX",
        "distances along the axis that count, in scene units, as in 0.3,12 or 0.3,inf. Others are invalid; the "
        "background stays");
}

void add_output_options(CLI::App& app, DepthOptions& options, const Product& product) {
    std::vector<std::string> formats, raw_formats;
    for (const std::string& extension : product.extensions)
        formats.push_back(extension.substr(1));
    for (const io::RawFormat& each : io::raw_formats)
        raw_formats.emplace_back(each.name);
    std::vector<std::string> all_formats = formats;
    all_formats.insert(all_formats.end(), raw_formats.begin(), raw_formats.end());
    add_option(app, "Output", "-o,--output", "OUT", options.output,
               "file to write (" + CLI::detail::join(product.extensions, " ") +
                   "), or a folder: results keep the names of their inputs there. Also ao.####.exr, or -")
        ->required();
    add_option(
        app, "Output", "--format", "TYPE", [&options](const std::string& format) { options.format = "." + format; },
        "type of the results in a folder: " + one_of(formats) + " (default: " + formats.front() +
            "), or of the pixels of -o -: " + one_of(raw_formats))
        ->check(is_one_of(all_formats));
    if (!product.png_scale)
        add_option(app, "Output", "--png-scale", "S", options.png_scale,
                   "write .png as round(value × S × 65535), 16 bits (" + scales.limits() + ")")
            ->check(is_in(scales));

    add_flag(app, "Output", "--append", options.append,
             "write a copy of the input EXR that has the result beside its own channels");
    add_flag(app, "Output", "--half", options.half, "write .exr of 16-bit floats (default: 32 bits)");
    add_enum_option(
        app, "Output", "--compression", options.compression,
        {{"none", ExrCompression::none},
         {"zips", ExrCompression::zips},
         {"zip", ExrCompression::zip},
         {"piz", ExrCompression::piz},
         {"dwaa", ExrCompression::dwaa}},
        "of .exr (default: zip). dwaa loses a little of channels called R, G, B or Y, N.Y and P.Y among them");
}

std::optional<Value> read(const Option& option, std::string text) {
    const std::string shared = value_spelled(option), before = shared.substr(0, shared.find(':') + 1);
    if (!text.starts_with(before))
        return std::nullopt;
    text.erase(0, before.size());
    if (shared.starts_with(text + "|")) // the word for none
        text = "0";
    if (double number = 0; option.kind == Kind::number && CLI::detail::lexical_cast(text, number))
        return number;
    const auto found = std::ranges::find(option.choices(), text, [](const char* name) { return std::string(name); });
    if (found != option.choices().end())
        return static_cast<std::size_t>(found - option.choices().begin());
    return value_of(option.kind, numbers_in(text, said_of(option.kind).count()));
}

using Options = std::vector<Option>; // of one name in the program, which exclude each other

const Option* option_for(const Options& options, const std::string& text) {
    const auto its = std::ranges::find_if(options, [&](const Option& one) { return parse(one, text).has_value(); });
    return its == options.end() ? nullptr : &*its;
}

std::string type_name(const Option& option) {
    if (const std::string shared = value_spelled(option); !shared.empty())
        return shared;
    if (option.kind == Kind::choice)
        return fmt::format("{}", fmt::join(option.choices(), "|"));
    if (const char* parts = said_of(option.kind).parts; *parts)
        return parts;
    return option.is_whole() ? "N" : option.range.infinite ? "X|inf" : "X";
}

// "ellipse:R: " of what shares the program's option.
std::string prefix(const Option& option) {
    const std::string shared = value_spelled(option);
    return shared.empty() ? "" : shared + ": ";
}

std::string refusal(const Options& options, const std::string& text) {
    const Option& option = options.front();
    if (option_for(options, text))
        return "";
    if (options.size() > 1)
        return fmt::format("'{}' will not do; it is {}{}, or {}{}", text, prefix(option), option.accepted(),
                           prefix(options[1]), options[1].accepted());
    if (option.kind == Kind::choice)
        return fmt::format("'{}' is unknown; it is {}", text, option.accepted());
    double number = 0;
    CLI::detail::lexical_cast(text, number);
    return fmt::format("'{}' will not do; it is {}{}", text,
                       said_of(option.kind).count() > 0 ? type_name(option) + ": " : "", option.instead_of(number));
}

std::string meaning(const Option& option) {
    std::string more = option.limits();
    if (!option.required)
        more += (more.empty() ? "default: " : "; default: ") + option.default_in_words();
    return more.empty() ? option.words : fmt::format("{} ({})", option.words, more);
}

CLI::Option* add(CLI::App& app, const Options& options, const SetOption& set) {
    const Option& option = options.front();
    const std::string name = spelled(option.name);
    std::string types, words = meaning(option);
    for (const Option& one : options) {
        types += (types.empty() ? "" : "|") + type_name(one);
        if (&one != &option)
            words += fmt::format("{}{}: {}", new_line, type_name(one), one.words);
    }
    if (option.kind == Kind::flag)
        return app.add_flag_function(
            name, [option, set](std::int64_t yes) { set(option, yes > 0); }, words);
    CLI::Option* added =
        app.add_option_function<std::string>(
               name,
               [options, set](const std::string& text) {
                   const Option& its = *option_for(options, text);
                   for (const Option& other : options)
                       if (other.offset != its.offset)
                           set(other, *other.by_default);
                   set(its, *parse(its, text));
               },
               words)
            ->type_name(types)
            ->check(CLI::Validator([options](std::string& text) { return refusal(options, text); }, ""));
    return added->required(option.required);
}

} // namespace

void add_raw_format_option(CLI::App& app, const char* name, const io::RawFormat*& format, int least_channels,
                           const char* what) {
    std::vector<std::pair<std::string, const io::RawFormat*>> formats;
    for (const io::RawFormat& each : io::raw_formats)
        if (each.channels >= least_channels)
            formats.emplace_back(each.name, &each);
    add_enum_option(app, "Pipes", name, format, formats,
                    fmt::format("the pixels {}, by ffmpeg's names (default: {})", what, format->name));
}

CLI::Validator is_one_of(const std::vector<std::string>& names) {
    return CLI::Validator(
        [names](std::string& text) {
            if (std::find(names.begin(), names.end(), text) != names.end())
                return std::string();
            return "'" + text + "' is unknown; it is " + one_of(names);
        },
        "");
}

CLI::Validator is_in(const description::Range& range) {
    return CLI::Validator(
        [range](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && range.holds(value))
                return std::string();
            return "'" + text + "' will not do; it is " + range.instead_of(value);
        },
        "");
}

std::string extent(const cv::Rect& data) {
    return io::described(data.size()) +
           (data.tl() == cv::Point() ? "" : fmt::format(" from pixel {},{} on", data.x, data.y));
}

void add_camera_options(CLI::App& app, CameraOption& camera, const std::string& description) {
    add_option(app, "Input", "--camera", "FILE", camera.file, description);
    add_option(app, "Input", "--preset", "NAME[:KEY=VALUE,...]", camera.preset,
               "the source of the depth, and what it or the camera leaves open, as in carla:fov_x_deg=90 (fathom "
               "presets) or encoding=view-z");
    add_import_options(app, camera);
}

void add_import_options(CLI::App& app, CameraOption& camera) {
    add_option(app, "Input", "--image", "NAME", camera.image, "whose camera of COLMAP or transforms.json");
    add_option(app, "Input", "--node", "NAME|INDEX", camera.node, "which camera of glTF");
    add_flag(app, "Input", "--undistorted", camera.undistorted,
             "the depth has been undistorted: take P of ROS, or the matrix of OpenCV without its distortion");
}

void add_frames_option(CLI::App& app, Inputs& inputs) {
    const auto take = [&inputs](const std::string& text) {
        try {
            inputs.frames = sequence::parse_frames(text);
        } catch (const std::invalid_argument& error) {
            throw CLI::ValidationError("--frames", error.what());
        }
    };
    add_option(
        app, "Frames", "--frames", "RANGE", take,
        "frames of shot.####.exr, as in 1-240, 1-240x2 (every second) or 1-9,20 (default: those that are there)");
}

void add_channel_option(CLI::App& app, std::string& channel) {
    add_option(app, "Input", "--channel", "NAME", channel,
               "EXR channel that holds the depth (default: Z, *.Depth.Z, V, *.Depth.V, *.Depth, *.ZDepth, *.Z, "
               "Y, or the only one)");
}

void add_device_options(CLI::App& app, DeviceOption& device) {
    add_option(app, "Device", "--device", "DEVICE", device.wanted,
               "where to compute: cpu, gpu, or an index or part of a name as `fathom devices` lists them (default: a "
               "GPU if there is one)");
    add_option(app, "Device", "--threads", "N", device.threads,
               "how many threads work at once: those of a CPU device (PoCL), or those that read and write (" +
                   thread_counts.limits() + "; default: all cores)")
        ->check(is_in(thread_counts));
}

void add_depth_options(CLI::App& app, DepthOptions& options, const Product& product) {
    options.command = app.get_name();
    options.given = [&app] {
        std::map<std::string, std::vector<std::string>> given;
        for (const CLI::Option* option : app.get_options())
            if (option->count() > 0)
                given[option->get_name()] = option->results();
        return given;
    };
    add_option(app, "Input", "DEPTH", "DEPTH", options.inputs.arguments,
               "depth images: EXR, 16-bit PNG, TIFF, PFM or NPY. Also a folder, or 'shot.####.exr', 'shot.%04d.exr' or "
               "'shot.*.exr'")
        ->required();
    options.camera.inputs = [&options]() -> const std::vector<Input>& { return options.inputs.all(); };
    add_camera_options(app, options.camera,
                       "camera file, glTF, transforms.json, OpenCV or ROS calibration, COLMAP folder, EXR "
                       "(docs/cameras.md; default: the depth's header)");
    add_channel_option(app, options.channel);
    add_ignore_options(app, options);
    add_frame_options(app, options);

    add_read_option(app, "Pipes", "--size", "WIDTHxHEIGHT", options.inputs.pipe_size, size_in, "as in 1920x1080",
                    "of the frames in pipes: DEPTH and IMAGE may be - (standard input) or a named pipe with raw "
                    "frames, and OUT may be -");
    add_raw_format_option(app, "--depth-format", options.inputs.pipe_format, 1, "of depth in a pipe");

    add_output_options(app, options, product);
    CLI::Option* quiet = add_flag(
        app, "Report", "--quiet", [&options] { options.report = Report::nothing; },
        "print nothing on success; warnings still come");
    add_flag(
        app, "Report", "--json", [&options] { options.report = Report::json; }, "print one line of JSON for each file")
        ->excludes(quiet);
    add_flag(app, "Report", "--strict", options.strict, "take warnings for errors: no result is written");
    add_flag(app, "Frames", "--resume", options.resume,
             "keep what is finished: a line beside each result says what made it, and a frame is made only if "
             "that changed (docs/sequences.md)");
    add_option(
        app, "Report", "--log", "FILE", options.log,
        "append lines of JSON to FILE: one for this run, and one for each frame with its times and warnings. - is "
        "stdout, in place of other lines");
    add_read_option(
        app, "Device", "--memory", "SIZE", options.memory, bytes_of, "a number above 0 and K, M, G or T, as in 8G",
        "what an operation may take beside its images, which it then does in bands, as in 8G or 500M, and what "
        "the images of all inputs in work may take if there are several (default: a quarter of the machine's, "
        "or of its container's, for the images)");
    add_enum_option(
        app, "Report", "--progress", options.progress,
        {{"auto", ProgressKind::automatic}, {"openjd", ProgressKind::openjd}, {"off", ProgressKind::off}},
        "of several inputs: a line where stderr is a terminal (auto; default), Open Job Description's lines on stdout "
        "(openjd), or none");
    add_device_options(app, options.device);
}

std::optional<Value> parse(const Option& option, const std::string& text) {
    const std::optional<Value> value = read(option, text);
    return value && option.accepts(*value) ? value : std::nullopt;
}

std::string spelled(std::string_view named) {
    static const std::map<std::string_view, std::string> others{
        {"alpha", ""},       {"channels", ""},     {"blades", "--aperture"}, {"ratio", "--aperture"},
        {"near_weight", ""}, {"focus_weight", ""}, {"far_weight", ""}};
    if (const auto other = others.find(named); other != others.end())
        return other->second;
    std::string name = "--" + std::string(named);
    std::ranges::replace(name, '_', '-');
    return name;
}

std::string spelled(const Option& option) {
    if (option.kind == Kind::depth && option.alternative && spelled(option.name) == "--thickness")
        return "--back-depth";
    return spelled(option.name) + (option.kind == Kind::lengths ? "-map" : "");
}

std::string value_spelled(const Option& option) {
    const std::string_view name = option.name;
    return name == "blades" ? "circle|N" : name == "ratio" ? "ellipse:R" : "";
}

void add_described_options(CLI::App& app, const std::vector<Option>& options, const SetOption& set,
                           const std::string& group) {
    std::vector<Options> named;
    for (const Option& option : options) {
        const std::string name = spelled(option.name);
        if (option.kind >= Kind::result || name.empty())
            continue;
        const auto same = std::ranges::find(named, name, [](const Options& own) { return spelled(own.front().name); });
        (same == named.end() ? named.emplace_back() : *same).push_back(option);
    }
    for (const Options& own : named)
        add(app, own, set)->group(group);
}

void check_together(const CLI::App& app, const description::Operation& operation) {
    std::vector<description::Given> given;
    const auto is_given = [&](std::string_view name) {
        const CLI::Option* added = name.empty() ? nullptr : app.get_option_no_throw(std::string(name));
        return added && added->count() > 0;
    };
    for (const std::vector<Option>* listed : operation.listed())
        for (const Option& option : *listed) {
            const std::string name = spelled(option);
            if (std::ranges::any_of(given, [&](const auto& each) { return spelled(*each.option) == name; }))
                continue; // which takes the values of several
            const bool in_file = option.kind == Kind::depth && !option.needs.empty(); // of the image that it belongs to
            if (!is_given(name) && !(in_file && is_given(spelled(option.needs.front()))))
                continue;
            const CLI::Option* own = app.get_option(name);
            given.push_back({&option, own->count() > 0 ? parse(option, own->as<std::string>()) : std::nullopt});
        }
    const std::string wrong = wrong_together(operation, given, [](const Option& option) { return spelled(option); });
    if (!wrong.empty())
        throw UsageError(wrong);
}

} // namespace fathom::cli
