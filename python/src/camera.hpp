#pragma once

#include "arrays.hpp"

#include <fathom/doubts.hpp>
#include <fathom/import_camera.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace fathom::python {

/// What `fathom.Camera` is made of: a camera file, and the camera of the last image's size.
struct CameraObject {
    ImportedCamera file;
    bool is_for_view_depth = false;
    mutable bool are_keys_told = false;           ///< what is probably wrong is told once
    mutable std::optional<DepthSketch> told = {}; ///< and again of depth that is other than this
    mutable Camera last = {};                     ///< read and written under the interpreter's lock

    /// Throws: Error naming both sizes if the camera is of another.
    const Camera& of_size(int width, int height) const {
        if (last.width != width || last.height != height) {
            const Camera camera = camera_for(file, width, height);
            last = is_for_view_depth ? ViewDepth{{}, camera}.stored().camera : camera;
        }
        return last;
    }
};

/// What an importer makes of a file: the text of a camera file, and warnings. `storage`: the number of an enumerator, or -1.
template <ImportedCamera import(const std::filesystem::path&, const ImportOptions&)>
std::pair<std::string, std::vector<std::string>>
camera_file(const std::filesystem::path& path, const std::string& image, const std::string& node,
            const std::string& preset, bool undistorted, int storage, const std::filesystem::path& depth) {
    ImportOptions options{.image = image, .node = node, .preset = preset, .undistorted = undistorted, .depth = depth};
    if (storage >= 0)
        options.storage = static_cast<Storage>(storage);
    const ImportedCamera camera = import(path, options);
    return {camera.text, camera.warnings};
}

} // namespace fathom::python
