#pragma once

#include <fathom/import_camera.hpp>

#include <nanobind/nanobind.h>

/// `fathom.Camera`.
namespace fathom::python {

namespace nb = nanobind;

/// A camera file, and the camera of the last image's size.
class CameraObject {
public:
    explicit CameraObject(ImportedCamera file) : file_(std::move(file)) {}

    const ImportedCamera& file() const { return file_; }

    /// Throws: Error naming both sizes if the camera is of another.
    const Camera& for_size(int width, int height) const;

    /// The same camera for view depth, which `linearize` makes.
    CameraObject for_view_depth() const;
    bool is_for_view_depth() const { return is_for_view_depth_; }

    /// Warns once of keys that hardly anybody means for an image of this size. `frames`: from here to the caller's line.
    void doubt(int width, int height, const std::string& name, int frames) const;

private:
    ImportedCamera file_;
    bool is_for_view_depth_ = false;
    mutable bool is_doubted_ = false;
    mutable Camera last_; // read and written under the interpreter's lock
};

void bind_camera(nb::module_& module);

} // namespace fathom::python
