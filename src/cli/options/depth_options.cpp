// Options that several commands share.
#include "depth_options.hpp"

#include "cli/command.hpp"
#include "sequence/frames.hpp"
#include "terminal/messages.hpp"

#include <fathom/error.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

namespace fathom::cli {
namespace {

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

std::vector<std::string> raw_names(int least_channels = 1) {
    std::vector<std::string> names;
    for (const io::RawFormat& format : io::raw_formats)
        if (format.channels >= least_channels)
            names.emplace_back(format.name);
    return names;
}

// What `read` makes something of.
template <typename Read>
CLI::Validator is_read_by(Read read, const std::string& what) {
    return CLI::Validator(
        [read, what](std::string& text) {
            return read(text) ? std::string() : "'" + text + "' will not do; it is " + what;
        },
        "");
}

} // namespace

void add_raw_format_option(CLI::App& app, const char* name, const io::RawFormat*& format, int least_channels,
                           const char* what) {
    const std::vector<std::string> names = raw_names(least_channels);
    add_option(
        app, "Pipes", name, CLI::detail::join(names, "|"),
        [&format](const std::string& text) { format = std::ranges::find(io::raw_formats, text, &io::RawFormat::name); },
        fmt::format("the pixels {}, by ffmpeg's names (default: {})", what, format->name))
        ->check(is_one_of(names));
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
    return fmt::format("{} × {}{}", data.width, data.height,
                       data.tl() == cv::Point() ? "" : fmt::format(" from pixel {},{} on", data.x, data.y));
}

std::vector<double> numbers_in(const std::string& text, std::size_t count) {
    std::vector<double> values;
    for (const std::string& part : CLI::detail::split(text, ',')) {
        double value;
        if (!CLI::detail::lexical_cast(part, value))
            return {};
        values.push_back(value);
    }
    return values.size() == count ? values : std::vector<double>{};
}

void add_camera_options(CLI::App& app, CameraOption& camera, const std::string& description) {
    add_option(app, "Input", "--camera", "FILE", camera.file, description);
    add_option(app, "Input", "--preset", "NAME[:KEY=VALUE,...]", camera.preset,
               "the source of the depth, and what it or the camera leaves open, as in\n"
               "carla:fov_x_deg=90 (fathom presets) or encoding=view-z");
    add_import_options(app, camera);
}

void add_import_options(CLI::App& app, CameraOption& camera) {
    add_option(app, "Input", "--image", "NAME", camera.image, "whose camera of COLMAP or transforms.json");
    add_option(app, "Input", "--node", "NAME|INDEX", camera.node, "which camera of glTF");
    app.add_flag("--undistorted", camera.undistorted,
                 "the depth has been undistorted: take P of ROS, or the matrix of\nOpenCV without its distortion")
        ->group("Input");
}

void add_channel_option(CLI::App& app, std::string& channel) {
    add_option(app, "Input", "--channel", "NAME", channel,
               "EXR channel that holds the depth\n(default: Z, *.Depth.Z, V, *.Depth.V, *.Depth, *.ZDepth, *.Z, "
               "Y,\nor the only one)");
}

void add_device_options(CLI::App& app, DeviceOption& device) {
    add_option(app, "Device", "--device", "DEVICE", device.wanted,
               "where to compute: cpu, gpu, or an index or part of a name\n"
               "as `fathom devices` lists them (default: a GPU if there is one)");
    add_option(app, "Device", "--threads", "N", device.threads,
               "how many threads work at once: those of a CPU device (PoCL), or\nthose that read and write (" +
                   thread_counts.limits() + "; default: all cores)")
        ->check(is_in(thread_counts));
}

namespace {

// An animated option is given anew for each frame, as if it stood on a command line of its own.

void give(CLI::Option& option, const std::string& value) {
    option.clear();
    option.add_result(value);
    option.run_callback();
}

// What an operation computes may change. Which files there are, and how they are read, may not: --relative-range and
// --focus-range change the depth as it is read.
bool can_change(const CLI::Option& option) {
    const auto is_one = [](const std::string& name, const std::vector<std::string>& names) {
        return std::ranges::find(names, name) != names.end();
    };
    return option.get_expected_max() == 1 && !option.get_positional() &&
           (option.get_name() == "--blur-px" ||
            !is_one(option.get_group(), {"Input", "Picture", "Distance", "Positions", "Frames", "Output", "Report",
                                         "Device", "Relative depth", "Options"}));
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
    const std::string meant = nearest(name, known);
    throw UsageError(fmt::format("--animate: '{}' is no option that changes from frame to frame; {}", name,
                                 meant.empty() ? "it is " + one_of(known) : "did you mean " + meant + "?"));
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

// Every value of the file is parsed and checked as the option itself does it, and the first one stays, so that what depends on the
// option can be checked before a frame is read.
void add_animate_options(CLI::App& app, DepthOptions& options) {
    CLI::Option* const animate =
        app.add_option_function<std::vector<std::string>>(
               "--animate",
               [&app, &options](const std::vector<std::string>& all) {
                   for (const std::string& each : all)
                       options.animations.push_back(animation_of(app, each));
               },
               "an option whose value changes: FILE holds a line\nFRAME,VALUE for each frame, or JSON "
               "(docs/sequences.md)")
            ->type_name("NAME=FILE")
            ->allow_extra_args(false)
            ->group("Frames");
    app.add_flag("--interpolate", options.interpolate, "fills the frames between two lines of --animate, evenly")
        ->needs(animate)
        ->group("Frames");
}

void add_frame_options(CLI::App& app, DepthOptions& options) {
    const auto take = [&options](const std::string& text) {
        try {
            options.inputs.frames = sequence::parse_frames(text);
        } catch (const std::invalid_argument& error) {
            throw CLI::ValidationError("--frames", error.what());
        }
    };
    add_option(app, "Frames", "--frames", "RANGE", take,
               "frames of shot.####.exr, as in 1-240, 1-240x2 (every second)\n"
               "or 1-9,20\n"
               "(default: those that are there)");
    add_enum_option(app, "--missing", options.inputs.missing, {{"error", Missing::error}, {"skip", Missing::skip}},
                    "a frame without its files is an error (default), or is left out\n(skip)")
        ->group("Frames");
    add_animate_options(app, options);
}

void add_ignore_options(CLI::App& app, DepthOptions& options) {
    CLI::Option* ignore = add_option(app, "Input", "--ignore", "FILE", options.ignore,
                                     "an image of the depth's size: pixels that are not 0 there do not\n"
                                     "count, as if they were invalid");
    add_option(
        app, "Input", "--ignore-below", "T", [&options](double below) { options.ignore_below = below; },
        "FILE is an alpha or a confidence: pixels below T do not count. An\n"
        "alpha is 0 to 1; other integers are as stored, or 0 to 1 if T < 1")
        ->check(is_in(description::any_number))
        ->needs(ignore);
    const auto limits = [](const std::string& text) {
        const std::vector<double> ends = numbers_in(text, 2);
        return !ends.empty() && ends[0] <= ends[1] ? std::optional(std::array{ends[0], ends[1]}) : std::nullopt;
    };
    add_option(
        app, "Input", "--valid", "MIN,MAX",
        [&options, limits](const std::string& text) { options.valid = limits(text); },
        "distances along the axis that count, in scene units, as in\n0.3,12 or 0.3,inf. Others are invalid; the "
        "background stays")
        ->check(is_read_by(limits, "two numbers MIN,MAX with MIN <= MAX"));
}

void add_run_options(CLI::App& app, DepthOptions& options) {
    add_option(
        app, "Device", "--memory", "SIZE", [&options](const std::string& text) { options.memory = *bytes_of(text); },
        "what an operation may take beside its images, which it then does\n"
        "in bands, as in 8G or 500M, and what the images of all inputs in\n"
        "work may take if there are several (default: a quarter of the\n"
        "machine's, or of its container's, for the images)")
        ->check(is_read_by(bytes_of, "a number above 0 and K, M, G or T, as in 8G"));
    add_enum_option(
        app, "--progress", options.progress,
        {{"auto", ProgressKind::automatic}, {"openjd", ProgressKind::openjd}, {"off", ProgressKind::off}},
        "of several inputs: a line where stderr is a terminal (auto;\ndefault), Open Job Description's lines on stdout "
        "(openjd), or none")
        ->group("Report");
}

void add_output_options(CLI::App& app, DepthOptions& options, const Product& product) {
    std::vector<std::string> formats, all_formats = raw_names();
    for (const std::string& extension : product.extensions)
        formats.push_back(extension.substr(1));
    all_formats.insert(all_formats.begin(), formats.begin(), formats.end());
    add_option(app, "Output", "-o,--output", "OUT", options.output,
               "file to write (" + CLI::detail::join(product.extensions, " ") +
                   "), or a folder:\nresults keep the names of their inputs there. Also ao.####.exr, or -")
        ->required();
    add_option(
        app, "Output", "--format", "TYPE", [&options](const std::string& format) { options.format = "." + format; },
        "type of the results in a folder: " + one_of(formats) + "\n(default: " + formats.front() +
            "), or of the pixels of -o -:\n" + one_of(raw_names()))
        ->check(is_one_of(all_formats));
    if (!product.png_scale)
        add_option(
            app, "Output", "--png-scale", "S", [&options](double scale) { options.png_scale = scale; },
            "write .png as round(value × S × 65535), 16 bits (" + scales.limits() + ")")
            ->check(is_in(scales));

    app.add_flag("--append", options.append,
                 "write a copy of the input EXR that has the result beside its own\nchannels")
        ->group("Output");
    app.add_flag("--half", options.half, "write .exr of 16-bit floats (default: 32 bits)")->group("Output");
    add_enum_option(
        app, "--compression", options.compression,
        {{"none", ExrCompression::none},
         {"zips", ExrCompression::zips},
         {"zip", ExrCompression::zip},
         {"piz", ExrCompression::piz},
         {"dwaa", ExrCompression::dwaa}},
        "of .exr (default: zip). dwaa loses a little of channels called\nR, G, B or Y, N.Y and P.Y among them")
        ->group("Output");
}

} // namespace

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
               "depth images: EXR, 16-bit PNG, TIFF, PFM or NPY. Also a folder,\n"
               "or 'shot.####.exr', 'shot.%04d.exr' or 'shot.*.exr'")
        ->required();
    options.camera.inputs = [&options]() -> const std::vector<Input>& { return options.inputs.all(); };
    add_camera_options(app, options.camera,
                       "camera file, glTF, transforms.json, OpenCV or ROS calibration,\n"
                       "COLMAP folder, EXR (docs/cameras.md; default: the depth's header)");
    add_channel_option(app, options.channel);
    add_ignore_options(app, options);
    add_frame_options(app, options);

    add_option(
        app, "Pipes", "--size", "WIDTHxHEIGHT",
        [&options](const std::string& text) { options.inputs.pipes.size = size_in(text); },
        "of the frames in pipes: DEPTH and IMAGE may be - (standard input)\n"
        "or a named pipe with raw frames, and OUT may be -")
        ->check(is_read_by(size_in, "as in 1920x1080"));
    add_raw_format_option(app, "--depth-format", options.inputs.pipes.depth, 1, "of depth in a pipe");

    add_output_options(app, options, product);
    CLI::Option* quiet = app.add_flag_callback(
        "--quiet", [&options] { options.report = Report::nothing; }, "print nothing on success; warnings still come");
    CLI::Option* json = app.add_flag_callback(
        "--json", [&options] { options.report = Report::json; }, "print one line of JSON for each file");
    quiet->group("Report");
    app.add_flag("--strict", options.strict, "take warnings for errors: no result is written")->group("Report");
    json->group("Report")->excludes(quiet);
    app.add_flag("--resume", options.resume,
                 "keep what is finished: a line beside each result says what made it,\nand a frame is made only if "
                 "that changed (docs/sequences.md)")
        ->group("Frames");
    add_option(
        app, "Report", "--log", "FILE", options.log,
        "append lines of JSON to FILE: one for this run, and one for each\nframe with its times and warnings. - is "
        "stdout, in place of other lines");
    add_run_options(app, options);

    add_device_options(app, options.device);
}

} // namespace fathom::cli
