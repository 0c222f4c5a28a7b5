// The module fathom._importers: cameras from files that need OpenCV, OpenEXR or YAML to be read.
#include "camera.hpp"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

NB_MODULE(_importers, module) {
    module.def("camera_file", fathom::python::camera_file<fathom::import_camera>);
}
