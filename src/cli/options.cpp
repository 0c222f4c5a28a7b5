// Options that several commands share.
#include "options.hpp"

#include "command.hpp"
#include "messages.hpp"

#include "camera_file/key_doubts.hpp"
#include "camera_file/presets.hpp"

#include <fathom/error.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace fathom::cli {

Device DeviceOption::open() const {
    if (threads > 0) {
        const std::string count = std::to_string(threads);
        setenv("POCL_MAX_PTHREAD_COUNT", count.c_str(), 1); // PoCL to 4
        setenv("POCL_CPU_MAX_CU_COUNT", count.c_str(), 1);  // PoCL from 5
    }
    return Device::open(wanted);
}

CameraFile CameraOption::read() const {
    if (!given())
        throw UsageError("--camera: missing; give a camera file, or --preset with the source of the depth "
                         "(fathom presets lists them)");
    if (!file.empty())
        return read_camera(file);
    try {
        CameraFile camera = preset_camera(preset);
        depth_form(camera_for(camera, camera.camera.width ? camera.camera.width : 64,
                              camera.camera.height ? camera.camera.height
                                                   : 48)); // values that contradict each other, whatever the image
        return camera;
    } catch (const Error& error) { // it is an argument
        throw UsageError(error.what());
    } catch (const std::invalid_argument& error) {
        throw UsageError(name() + ": " + error.what());
    }
}

std::vector<std::string> CameraOption::doubts(int width, int height) const {
    const nlohmann::json keys =
        file.empty() ? io::parsed_preset(name(), preset) : nlohmann::json::parse(std::ifstream(file), nullptr, false);
    return io::key_doubts(keys, width, height);
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
    CLI::Option* file = app.add_option("--camera", camera.file, description)->type_name("CAMERA.json")->group("Input");
    app.add_option("--preset", camera.preset,
                   "instead of a camera file: the source of the depth, and what it\n"
                   "leaves open, as in carla:fov_x_deg=90 (fathom presets)")
        ->type_name("NAME[:KEY=VALUE,...]")
        ->excludes(file)
        ->group("Input");
}

void add_channel_option(CLI::App& app, std::string& channel) {
    app.add_option("--channel", channel,
                   "EXR channel that holds the depth\n(default: Z, *.Depth.Z, V, depth.V, Y, or the only one)")
        ->type_name("NAME")
        ->group("Input");
}

void add_device_options(CLI::App& app, DeviceOption& device) {
    app.add_option("--device", device.wanted,
                   "where to compute: cpu, gpu, or an index or part of a name\n"
                   "as `fathom devices` lists them (default: a GPU if there is one)")
        ->type_name("DEVICE")
        ->group("Device");
    app.add_option("--threads", device.threads, "number of threads of a CPU device (PoCL; default: all cores)")
        ->type_name("N")
        ->check(is_a_number("whole number from 1 to 4096",
                            [](double n) { return n == std::floor(n) && n >= 1 && n <= 4096; }))
        ->group("Device");
}

void add_depth_options(CLI::App& app, DepthOptions& options, const Product& product) {
    app.add_option("DEPTH", options.inputs, "depth images: EXR, 16-bit PNG, TIFF or PFM")
        ->type_name("DEPTH")
        ->required()
        ->group("Input");
    add_camera_options(app, options.camera, "camera file: the projection and what the values mean\n(docs/camera.md)");
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
