#pragma once

#include <fathom/findings.hpp>
#include <fathom/import_camera.hpp>

#include <nanobind/nanobind.h>

#include <string>
#include <vector>

/// `fathom.Camera`.
namespace fathom::python {

namespace nb = nanobind;

/// A camera file, and the camera of the last image's size.
class CameraObject {
public:
    explicit CameraObject(ImportedCamera file) : file_(std::move(file)) {}

    const ImportedCamera& file() const { return file_; }

    /// Throws: Error naming both sizes if the camera is of another.
    const Camera& of_size(int width, int height) const;

    /// The same, with a warning of doubtful keys.
    const Camera& for_size(int width, int height) const;

    /// The same camera for view depth, which `linearize` makes.
    CameraObject for_view_depth() const;
    bool is_for_view_depth() const { return is_for_view_depth_; }

    /// Warns once of keys that hardly anybody means for an image of this size.
    void doubt(int width, int height, const std::string& name, int frames = 1) const;

    /// Looks once at a sample of depth of the last size, and warns of what is probably wrong.
    void doubt(const HostDepth& stored, const char* argument) const;

private:
    ImportedCamera file_;
    bool is_for_view_depth_ = false;
    mutable bool is_doubted_ = false, is_depth_doubted_ = false;
    mutable Camera last_; // read and written under the interpreter's lock
};

/// Warns of what is probably wrong: a `CameraWarning` each, so many of Python's frames above.
void warn(const std::vector<std::string>& warnings, const std::string& name, int frames = 1);

/// A message of the importers, whose options are the program's, with Python's arguments.
std::string in_python(const std::string& said);

} // namespace fathom::python
