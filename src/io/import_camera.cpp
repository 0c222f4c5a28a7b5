// Cameras from files of any kind that Fathom knows; the content decides, for COLMAP the name.
#include "camera_formats.hpp"
#include "formats.hpp"

#include "camera_file/file.hpp"

#include <fathom/import_camera.hpp>

#include <fstream>
#include <iterator>

namespace fs = std::filesystem;

namespace fathom {
namespace io {
namespace {

/// The first character that is no white space and no byte order mark.
char first_character(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    constexpr std::string_view skipped = " \t\r\n\xef\xbb\xbf";
    for (std::istreambuf_iterator<char> at(stream), end; at != end; ++at)
        if (skipped.find(*at) == std::string_view::npos)
            return *at;
    return 0;
}

bool begins_with(const fs::path& file, const std::string& magic) {
    std::string bytes(magic.size(), '\0');
    std::ifstream(file, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return bytes == magic;
}

void refuse_choice(const fs::path& file, const std::string& chosen, const char* option, const char* formats) {
    if (!chosen.empty())
        refuse(file, std::string("holds one camera, so leave out ") + option + "; that is for " + formats);
}

Imported imported_by_format(const fs::path& file, const ImportOptions& options) {
    if (is_colmap(file)) {
        refuse_choice(file, options.node, "--node", "glTF");
        return import_colmap(file, options);
    }
    check_readable(file);
    const bool exr = begins_like_exr(file);
    const char first = first_character(file);
    if (!exr && (first == '{' || first == 'g')) {
        auto json = first == 'g' && !begins_with(file, "glTF") ? nlohmann::json() : parsed_json_or_glb(file);
        if (json.is_object() && !json.contains("camera_matrix") && !json.contains("distortion_model"))
            return import_parsed(file, std::move(json), options);
    }
    if (!exr && first != 0 && static_cast<unsigned char>(first) >= 0x80)
        refuse(file, "is no camera, but an image or another binary file; give a camera file (docs/cameras.md)");
    if (!exr && first == '<')
        refuse(file, "is XML, or a page; write OpenCV's calibrations as .yml");
    refuse_choice(file, options.node, "--node", "glTF");
    refuse_choice(file, options.image, "--image", "COLMAP and transforms.json");
    if (exr && options.undistorted)
        refuse(file, "is no calibration of OpenCV or ROS, which --undistorted is for; leave it out");
    return exr ? import_exr(file) : import_calibration(file, options);
}

} // namespace
} // namespace io

ImportedCamera import_camera(const fs::path& file, const ImportOptions& options) {
    return io::completed(file, io::imported_by_format(file, options), options);
}

} // namespace fathom
