// Options that several commands share.
#include "options.hpp"

#include "command.hpp"
#include "messages.hpp"

#include "camera_file/key_doubts.hpp"
#include "camera_file/presets.hpp"
#include "io/camera_formats.hpp"

#include <fathom/error.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

namespace fathom::cli {

Device DeviceOption::open() const {
    if (threads > 0) {
        const std::string count = std::to_string(threads);
        setenv("POCL_MAX_PTHREAD_COUNT", count.c_str(), 1); // PoCL to 4
        setenv("POCL_CPU_MAX_CU_COUNT", count.c_str(), 1);  // PoCL from 5
    }
    set_exr_threads(threads);
    return Device::open(wanted);
}

namespace {

// The preset alone, as an argument.
ImportedCamera named_camera(const std::string& preset) {
    try {
        const CameraFile camera = preset_camera(preset);
        const int width = camera.camera.width > 0 ? camera.camera.width : 64,
                  height = camera.camera.height > 0 ? camera.camera.height : 48;
        depth_form(camera_for(camera, width, height)); // values that contradict each other, whatever the image
        return {camera, io::parsed_preset("preset " + preset, preset).dump(), {}};
    } catch (const Error& error) {
        throw UsageError(error.what());
    } catch (const std::invalid_argument& error) {
        throw UsageError("preset " + preset + ": " + error.what());
    }
}

bool is_complete(const std::string& preset) {
    try {
        preset_camera(preset);
        return true;
    } catch (const Error&) {
        return false;
    }
}

} // namespace

std::string CameraOption::name() const {
    return !file.empty() ? file : !preset.empty() ? "preset " + preset : inputs ? inputs->front() : "the camera";
}

bool CameraOption::of_headers() const {
    return file.empty() && (preset.empty() || !is_complete(preset));
}

ImportedCamera CameraOption::read_for(const std::string& depth, Storage storage) const {
    const bool of_header = of_headers() && io::exr_has_camera(depth);
    if (!of_header && !given())
        throw Error(depth +
                    ": has no camera in its header; give a camera file (--camera), or --preset with the source of "
                    "the depth");
    if (!of_header && file.empty())
        return named_camera(preset);
    return import_camera(of_header ? depth : file, {.image = image,
                                                    .node = node,
                                                    .preset = preset,
                                                    .undistorted = undistorted,
                                                    .storage = storage,
                                                    .depth = depth});
}

ImportedCamera CameraOption::read() const {
    if (file.empty() && (!image.empty() || !node.empty() || undistorted))
        throw UsageError("--image, --node and --undistorted: choose from a file; give it with --camera");
    std::vector<std::string> depths = inputs ? *inputs : std::vector<std::string>{};
    if (!given()) {
        std::erase_if(depths, [](const std::string& depth) { return !io::exr_has_camera(depth); });
        if (depths.empty())
            throw UsageError(std::string("--camera: missing; give a camera file, --preset with the source of the depth "
                                         "(fathom presets lists them)") +
                             (or_relative ? ", or --relative for depth without a unit" : ""));
    }
    if (depths.empty())
        depths.emplace_back();
    for (std::size_t i = 0; i + 1 < depths.size(); ++i) {
        try {
            return read_for(depths[i]);
        } catch (const Error&) { // is told when the turn of this input comes
        }
    }
    return read_for(depths.back());
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

CLI::Validator is_a_number(const std::string& kind, const std::function<bool(double)>& accepted) {
    return CLI::Validator(
        [kind, accepted](std::string& text) {
            double value;
            const bool good = CLI::detail::lexical_cast(text, value) && std::isfinite(value) && accepted(value);
            return good ? std::string() : "'" + text + "' will not do; it is a " + kind;
        },
        "");
}

void add_camera_options(CLI::App& app, CameraOption& camera, const std::string& description) {
    app.add_option("--camera", camera.file, description)->type_name("FILE")->group("Input");
    app.add_option("--preset", camera.preset,
                   "the source of the depth, and what it or the camera leaves open, as in\n"
                   "carla:fov_x_deg=90 (fathom presets) or encoding=view-z")
        ->type_name("NAME[:KEY=VALUE,...]")
        ->group("Input");
    add_import_options(app, camera);
}

void add_import_options(CLI::App& app, CameraOption& camera) {
    app.add_option("--image", camera.image, "whose camera of COLMAP or transforms.json")
        ->type_name("NAME")
        ->group("Input");
    app.add_option("--node", camera.node, "which camera of glTF")->type_name("NAME|INDEX")->group("Input");
    app.add_flag("--undistorted", camera.undistorted,
                 "the depth has been undistorted: take P of ROS, or the matrix of\nOpenCV without its distortion")
        ->group("Input");
}

void add_channel_option(CLI::App& app, std::string& channel) {
    app.add_option("--channel", channel,
                   "EXR channel that holds the depth\n(default: Z, *.Depth.Z, V, *.Depth.V, *.Depth, *.ZDepth, *.Z, "
                   "Y,\nor the only one)")
        ->type_name("NAME")
        ->group("Input");
}

void add_device_options(CLI::App& app, DeviceOption& device) {
    app.add_option("--device", device.wanted,
                   "where to compute: cpu, gpu, or an index or part of a name\n"
                   "as `fathom devices` lists them (default: a GPU if there is one)")
        ->type_name("DEVICE")
        ->group("Device");
    app.add_option("--threads", device.threads,
                   "number of threads of a CPU device (PoCL) and of OpenEXR\n(default: all cores)")
        ->type_name("N")
        ->check(is_a_number("whole number from 1 to 4096",
                            [](double n) { return n == std::floor(n) && n >= 1 && n <= 4096; }))
        ->group("Device");
}

void add_depth_options(CLI::App& app, DepthOptions& options, const Product& product) {
    app.add_option("DEPTH", options.inputs, "depth images: EXR, 16-bit PNG, TIFF, PFM or NPY")
        ->type_name("DEPTH")
        ->required()
        ->group("Input");
    options.camera.inputs = &options.inputs;
    add_camera_options(app, options.camera,
                       "camera file, glTF, transforms.json, OpenCV or ROS calibration,\n"
                       "COLMAP folder, EXR (docs/cameras.md; default: the depth's header)");
    add_channel_option(app, options.channel);

    std::vector<std::string> formats;
    for (const std::string& extension : product.extensions)
        formats.push_back(extension.substr(1));
    app.add_option("-o,--output", options.output,
                   "file to write (" + CLI::detail::join(product.extensions, " ") +
                       "), or a folder:\nresults keep the names of their inputs there")
        ->type_name("OUT")
        ->required()
        ->group("Output");
    app.add_option_function<std::string>(
           "--format", [&options](const std::string& format) { options.format = "." + format; },
           "type of the results in a folder: " + one_of(formats) + "\n(default: " + formats.front() + ")")
        ->type_name("TYPE")
        ->check(is_one_of(formats))
        ->group("Output");
    if (!product.png_scale)
        app.add_option_function<double>(
               "--png-scale", [&options](double scale) { options.png_scale = scale; },
               "write .png as round(value × S × 65535), 16 bits")
            ->type_name("S")
            ->check(is_a_number("number above 0", [](double scale) { return scale > 0; }))
            ->group("Output");

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

    CLI::Option* quiet = app.add_flag_callback(
        "--quiet", [&options] { options.report = Report::nothing; }, "print nothing on success; warnings still come");
    CLI::Option* json = app.add_flag_callback(
        "--json", [&options] { options.report = Report::json; }, "print one line of JSON for each file");
    quiet->group("Report");
    app.add_flag("--strict", options.strict, "take warnings for errors: no result is written")->group("Report");
    json->group("Report")->excludes(quiet);

    add_device_options(app, options.device);
}

} // namespace fathom::cli
