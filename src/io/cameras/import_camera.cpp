// Cameras from files of any kind that Fathom knows; the content decides, for COLMAP the name.
#include "camera_formats.hpp"

#include "camera_file/file.hpp"
#include "camera_file/lens_key.hpp"
#include "io/formats.hpp"

#include <fathom/import_camera.hpp>
#include <fathom/io.hpp>

#include <algorithm>

namespace fs = std::filesystem;

namespace fathom {
namespace io {
namespace {

Imported imported_by_format(const fs::path& file, const ImportOptions& options) {
    if (is_colmap(file)) {
        refuse_choice(file, options.node, "--node", "glTF");
        return import_colmap(file, options);
    }
    check_readable(file);
    const bool exr = begins_like_exr(file);
    const Bytes head = read_head(file, 1 << 16);
    const std::string_view text = text_of(head);
    const std::size_t begin = text.find_first_not_of(" \t\r\n\xef\xbb\xbf"); // behind a byte order mark
    const char first = begin == text.npos ? '\0' : text[begin];
    if (!exr && (first == '{' || text.starts_with("glTF"))) {
        auto json = parsed_json_or_glb(file);
        if (json.is_object() && !json.contains("camera_matrix") && !json.contains("distortion_model"))
            return import_parsed(file, std::move(json), options);
    }
    constexpr std::size_t some = 1024; // of a text, that has no byte of 0
    const bool is_binary = static_cast<unsigned char>(first) >= 0x80 || text.substr(0, some).find('\0') != text.npos;
    if (!exr && is_binary)
        refuse(file, "is no camera, but an image or another binary file; give a camera file (docs/cameras.md)");
    if (!exr && first == '<')
        refuse(file, "is XML, or a page; write OpenCV's calibrations as .yml");
    refuse_choice(file, options.node, "--node", "glTF");
    if (exr)
        refuse_choice(file, options.image, "--image", formats_of_images);
    if (exr && options.undistorted)
        refuse(file, "is no calibration of OpenCV or ROS, which --undistorted is for; leave it out");
    return exr ? import_exr(file) : import_calibration(file, options);
}

/// Rays as normals lie in files: three channels, 0 where there is none. Files round, so that lengths are made 1.
RayMap read_ray_map(const fs::path& file) {
    cv::Mat rays;
    try {
        rays = read_normals(file);
    } catch (const UnansweredRead&) {
        throw;
    } catch (const Error& error) {
        throw Error(std::string(error.what()) +
                    "; a map of rays has three channels of floats, x right, y down and z ahead (EXR, TIFF or NPY)");
    }
    RayMap map{rays.cols, rays.rows};
    for (cv::Vec3f ray : cv::Mat_<cv::Vec3f>(rays)) {
        const double length = std::hypot(ray[0], ray[1], ray[2]);
        for (int i = 0; i < 3; ++i)
            map.rays.push_back(length > 0 ? static_cast<float>(ray[i] / length) : 0.0f);
    }
    return map;
}

} // namespace

void refuse_choice(const fs::path& file, const std::string& chosen, const char* option, const char* formats) {
    if (!chosen.empty())
        refuse(file, std::string("holds one camera, so leave out ") + option + "; that is for " + formats);
}

} // namespace io

ImportedCamera import_camera(const fs::path& file, const ImportOptions& options) {
    static const bool reads_rays = (io::ray_reader() = io::read_ray_map, true);
    static_cast<void>(reads_rays);
    return io::completed(file, io::imported_by_format(file, options), options);
}

} // namespace fathom
