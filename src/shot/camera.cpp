// Where the cameras of the inputs come from.
#include "options.hpp"

#include "camera/form.hpp"
#include "camera_file/file.hpp"
#include "camera_file/json_object.hpp"
#include "io/cameras/camera_formats.hpp"
#include "io/formats.hpp"
#include "sequence/frames.hpp"
#include "terminal/exit.hpp"

#include <fathom/error.hpp>

#include <stdexcept>

namespace fathom::cli {
namespace {

// The preset alone, as an argument.
ImportedCamera named_camera(const std::string& preset) {
    try {
        const CameraFile camera = preset_file(preset);
        const int width = camera.camera.width > 0 ? camera.camera.width : 64,
                  height = camera.camera.height > 0 ? camera.camera.height : 48;
        depth_form(
            straightened(camera_for(camera, width, height))); // values that contradict each other, whatever the image
        return {camera, io::parsed_preset("preset " + preset, preset).dump(), {}};
    } catch (const Error& error) {
        throw UsageError(error.what());
    } catch (const std::invalid_argument& error) {
        throw UsageError("preset " + preset + ": " + error.what());
    }
}

bool is_complete(const std::string& preset) {
    try {
        preset_file(preset);
        return true;
    } catch (const Error&) {
        return false;
    }
}

} // namespace

std::string CameraOption::name() const {
    return !file.empty() ? file : !preset.empty() ? "preset " + preset : inputs ? inputs().front().file : "the camera";
}

bool CameraOption::of_headers() const {
    return file.empty() && (preset.empty() || !is_complete(preset));
}

bool CameraOption::is_pattern() const {
    return sequence::FramePattern::in(file) && !io::is_there(file);
}

std::string CameraOption::file_for(const Input& input) const {
    if (!is_pattern())
        return file;
    if (!input.frame)
        throw UsageError(input.file + ": its name holds no frame, which --camera " + file +
                         " needs; give it a number, as in shot.0001.exr");
    return sequence::FramePattern::in(file)->name(*input.frame);
}

std::vector<std::filesystem::path> CameraOption::files_for(const Input& input) const {
    if (file.empty() || (of_headers() && io::exr_has_camera(input.file)))
        return {};
    const std::filesystem::path one = file_for(input);
    return io::is_colmap(one) ? io::colmap_files(one) : std::vector{one};
}

ImportedCamera CameraOption::read_for(const Input& input, Storage storage) const {
    const std::string& depth = input.file;
    const bool of_header = of_headers() && io::exr_has_camera(depth);
    if (!of_header && !given())
        throw Error(depth +
                    ": has no camera in its header; give a camera file (--camera), or --preset with the source of "
                    "the depth");
    if (!of_header && file.empty())
        return named_camera(preset);
    return import_camera(of_header ? depth : file_for(input), {.image = image,
                                                               .node = node,
                                                               .preset = preset,
                                                               .undistorted = undistorted,
                                                               .storage = storage,
                                                               .depth = depth});
}

ImportedCamera CameraOption::read() const {
    return read(inputs ? inputs() : std::vector<Input>{}, true);
}

void CameraOption::first_for(const std::function<void(const ImportedCamera&)>& use) const {
    if (!is_pattern()) {
        std::optional<ImportedCamera> camera;
        try {
            camera = read();
        } catch (const Error&) { // is told when all inputs are planned
            return;
        }
        return use(*camera);
    }
    std::exception_ptr lacking;
    for (const Input& depth : inputs()) {
        try {
            return use(read_for(depth));
        } catch (const UsageError&) {
            if (!lacking)
                lacking = std::current_exception();
        } catch (const Error&) { // is told when the turn of this input comes
        }
    }
    if (lacking)
        std::rethrow_exception(lacking);
}

ImportedCamera CameraOption::read(std::vector<Input> depths, bool first_counts) const {
    if (file.empty() && (!image.empty() || !node.empty() || undistorted))
        throw UsageError("--image, --node and --undistorted: choose from a file; give it with --camera");
    if (!given()) {
        std::exception_ptr unanswered;
        std::erase_if(depths, [&](const Input& depth) {
            try {
                return !io::exr_has_camera(depth.file);
            } catch (const io::UnansweredRead&) { // is told when the turn of this input comes, if there is another one
                unanswered = std::current_exception();
                return true;
            }
        });
        if (unanswered && (depths.empty() || first_counts))
            std::rethrow_exception(unanswered);
        if (depths.empty())
            throw UsageError(
                std::string("--camera: missing; give a camera file or --preset with the source of the depth "
                            "(fathom presets lists them)") +
                (or_relative ? ", or --relative for depth without a unit" : ""));
    }
    if (depths.empty())
        depths.emplace_back();
    for (std::size_t i = 0; i + 1 < depths.size(); ++i) {
        try {
            return read_for(depths[i]);
        } catch (const io::UnansweredRead&) {
            if (first_counts)
                throw;
        } catch (const Error&) { // is told when the turn of this input comes
        }
    }
    return read_for(depths.back());
}

} // namespace fathom::cli
