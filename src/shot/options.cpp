// Where the cameras of the inputs come from; and the device of a run, and how many threads work beside it.
#include "work.hpp"

#include "camera/form.hpp"
#include "camera_file/json_object.hpp"
#include "io/cameras/camera_formats.hpp"
#include "runtime/program.hpp"

#include <fathom/error.hpp>
#include <fathom/exr.hpp>
#include <fathom/supersampled.hpp>

#include <fmt/format.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <opencv2/core/utility.hpp>

#include <algorithm>
#include <cstdlib>
#include <thread>

namespace fathom::shot {
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

int cores() {
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

} // namespace

std::string CameraOption::name() const {
    return !file.empty() ? file : !preset.empty() ? "preset " + preset : inputs ? inputs().front().file : "the camera";
}

bool CameraOption::of_headers() const {
    return file.empty() && (preset.empty() || !io::if_any([&] { return preset_file(preset); }));
}

std::string CameraOption::file_for(const Input& input) const {
    const auto pattern = pattern_in(file);
    return pattern ? named(*pattern, "--camera", input) : file;
}

std::vector<std::filesystem::path> CameraOption::files_for(const Input& input) const {
    if (file.empty())
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

void CameraOption::first_for(const std::function<void(const ImportedCamera&)>& use) const {
    std::exception_ptr lacking;
    for (const Input& depth : inputs()) {
        try {
            return use(read_for(depth));
        } catch (const UsageError&) {
            if (!of_headers() && !is_pattern()) // all have the same
                throw;
            if (!lacking)
                lacking = std::current_exception();
        } catch (const Error&) { // is told when all inputs are planned, or when the turn of this one comes
        }
    }
    if (lacking)
        std::rethrow_exception(lacking);
}

ImportedCamera CameraOption::read() const {
    if (file.empty() && (!image.empty() || !node.empty() || undistorted))
        throw UsageError("--image, --node and --undistorted: choose from a file; give it with --camera");
    std::exception_ptr failure;
    for (const Input& depth : inputs()) {
        try {
            if (given() || io::exr_has_camera(depth.file))
                return read_for(depth);
        } catch (const Error&) { // is told when the turn of this input comes, if there is another one
            failure = std::current_exception();
        }
    }
    if (failure)
        std::rethrow_exception(failure);
    throw UsageError(std::string("--camera: missing; give a camera file or --preset with the source of the depth "
                                 "(fathom presets lists them)") +
                     (or_relative ? ", or --relative for depth without a unit" : ""));
}

cv::Size size_for(const CameraFile& file, const Windows& windows, const std::optional<cv::Size>& picture,
                  int supersampled) {
    const cv::Size own(file.camera.width, file.camera.height);
    if (picture && own == *picture)
        return *picture;
    return own == windows.display ? own : windows.display / supersampled;
}

Camera camera_of(const CameraFile& file, const Windows& windows, const std::optional<cv::Size>& picture,
                 int supersampled) {
    const cv::Size size = size_for(file, windows, picture, supersampled), own(file.camera.width, file.camera.height);
    if (supersampled > 1 && !own.empty() && own != size)
        throw Error(fmt::format(
            "the camera is for {} pixels; --supersampled {} takes one of the frame's {}, or of the results' {}",
            io::described(own), supersampled, io::described(windows.display), io::described(size)));
    Camera camera = camera_for(file, size.width, size.height);
    if (size == windows.display / supersampled)
        camera = fathom::supersampled(camera, supersampled);
    camera.width = windows.display.width;
    camera.height = windows.display.height;
    const cv::Rect& part = windows.data;
    return has_overscan(windows) ? cropped(camera, part.x, part.y, part.width, part.height) : camera;
}

void check_squares(const std::filesystem::path& file, const Windows& windows, int factor) {
    const auto& [data, display] = windows;
    for (const int side : {data.x, data.y, data.width, data.height, display.width, display.height})
        if (side % factor != 0)
            io::refuse(
                file,
                fmt::format("has {} pixels from {},{} on, of {} in all; --supersampled {} needs multiples of {} there",
                            io::described(data.size()), data.x, data.y, io::described(display), factor, factor));
}

void DeviceOption::prepare(std::size_t memory) const {
    if (threads > 0) {
        const std::string count = std::to_string(threads);
        setenv("POCL_MAX_PTHREAD_COUNT", count.c_str(), 1); // PoCL to 4
        setenv("POCL_CPU_MAX_CU_COUNT", count.c_str(), 1);  // PoCL from 5
    }
    runtime::compile_apart(kernels_hash()); // before there are threads that may hold a lock
#ifdef __GLIBC__
    if (memory >
        0) { // large images go back to the system when they are freed, in place of being kept for the next frame
        mallopt(M_MMAP_THRESHOLD, 32 << 20);
        mallopt(M_MMAP_MAX, 65536);
    }
#endif
    set_exr_threads(threads);
    if (threads > 0) // oneTBB warns of more than there are
        cv::setNumThreads(std::min(threads, cores()));
}

std::string kernels_hash() {
    std::string all;
    for (const auto& [name, text] : fathom_kernel_files())
        all.append(name).append(1, '\0').append(text).append(1, '\0');
    return io::digest(all);
}

Device DeviceOption::open(std::size_t memory) const {
    constexpr std::size_t least_memory = std::size_t{64} << 20; // so that any SIZE does for small images
    return Device::open(wanted, {.memory_budget = memory > 0 ? std::max(memory, least_memory) : 0});
}

bool DeviceOption::takes_turns(const Device& opened) const {
    return opened.info().cpu && threads > 0 && threads < cores();
}

void DeviceOption::share_among(std::size_t files) const {
    const int at_once = static_cast<int>(std::clamp<std::size_t>(files, 1, static_cast<std::size_t>(threads)));
    io::set_exr_pool(threads - at_once);
    cv::setNumThreads(threads / at_once);
}

} // namespace fathom::shot
