// fathom camera
#include "cli/options.hpp"
#include "io/replace_files.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

namespace fathom::cli {
namespace {

struct CameraArguments {
    CameraOption camera;
    std::string output;
    bool strict = false;
};

int convert(const CameraArguments& options) {
    const CameraOption& camera = options.camera;
    if (!options.output.empty()) {
        if (extension_of(options.output) != ".json")
            throw UsageError(options.output + ": a camera file is written as .json; name it so");
        if (io::is_same(options.output, camera.file))
            throw UsageError("-o: " + options.output + " would replace the file that is read; choose another name");
    }
    const ImportedCamera imported = import_camera(
        camera.file,
        {.image = camera.image, .node = camera.node, .preset = camera.preset, .undistorted = camera.undistorted});
    for (const std::string& warning : imported.warnings) {
        if (options.strict)
            throw Error(camera.file + ": " + warning);
        complain(fmt::format("warning: {}: {}", camera.file, warning));
    }
    if (options.output.empty())
        fmt::print("{}", imported.text);
    else
        io::replace_files(std::array{io::NewFile{options.output, {imported.text.begin(), imported.text.end()}}});
    return done;
}

std::function<int()> configure_camera(CLI::App& app) {
    const auto options = std::make_shared<CameraArguments>();
    add_option(app, "Input", "FILE", "FILE", options->camera.file,
               "camera file, glTF, transforms.json, OpenCV or ROS calibration, COLMAP folder, or EXR")
        ->required();
    add_option(app, "Input", "--preset", "NAME[:KEY=VALUE,...]", options->camera.preset,
               "what the values of the depth mean where FILE does not say it: a source (fathom presets), or keys as in "
               "encoding=view-z");
    add_import_options(app, options->camera);
    add_option(app, "Output", "-o,--output", "OUT.json", options->output, "camera file to write (default: print it)");
    add_flag(app, "Report", "--strict", options->strict, "take warnings for errors");
    return [options] { return convert(*options); };
}

} // namespace

extern const Command camera_command{
    .name = "camera",
    .summary = "Makes a camera file of a camera from another program.",
    .notes =
        R"(The commands read the same files with --camera. A camera file can be read and changed. docs/cameras.md has a row for
each format.

Example:
  fathom camera scene.glb --node Camera -o camera.json
  fathom camera dense/sparse --image left.jpg --preset colmap -o camera.json)",
    .configure = configure_camera,
};

} // namespace fathom::cli
