// The module fathom._importers: cameras from files that need OpenCV, OpenEXR or YAML to be read.
#include "words.hpp"

#include <fathom/error.hpp>
#include <fathom/import_camera.hpp>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace nb = nanobind;

namespace {

// The text of a camera file, and warnings.
nb::tuple camera_file(const std::filesystem::path& path, const std::string& image, const std::string& node,
                      const std::string& preset, bool undistorted, const fathom::python::Word<fathom::Storage>& storage,
                      const std::filesystem::path& depth) {
    try {
        const fathom::ImportedCamera camera = fathom::import_camera(path, {.image = image,
                                                                           .node = node,
                                                                           .preset = preset,
                                                                           .undistorted = undistorted,
                                                                           .storage = storage.get("storage"),
                                                                           .depth = depth});
        return nb::make_tuple(camera.text, camera.warnings);
    } catch (const fathom::Error& error) {
        PyErr_SetString(nb::module_::import_("fathom._fathom").attr("Error").ptr(),
                        fathom::python::in_python(error.what()).c_str());
        throw nb::python_error();
    }
}

} // namespace

NB_MODULE(_importers, module) {
    module.def("camera_file", camera_file, nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg().none(),
               nb::arg());
}
