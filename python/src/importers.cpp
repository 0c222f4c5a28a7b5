// The module fathom._importers: cameras from files that need OpenCV, OpenEXR or YAML to be read.
#include <fathom/import_camera.hpp>

#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace nb = nanobind;

namespace {

// The text of a camera file, and warnings. `storage`: the number of an enumerator.
nb::tuple camera_file(const std::filesystem::path& path, const std::string& image, const std::string& node,
                      const std::string& preset, bool undistorted, std::optional<int> storage,
                      const std::filesystem::path& depth) {
    fathom::ImportOptions options{
        .image = image, .node = node, .preset = preset, .undistorted = undistorted, .depth = depth};
    if (storage)
        options.storage = static_cast<fathom::Storage>(*storage);
    const fathom::ImportedCamera camera = fathom::import_camera(path, options);
    return nb::make_tuple(camera.text, camera.warnings);
}

} // namespace

NB_MODULE(_importers, module) {
    module.def("camera_file", camera_file);
}
