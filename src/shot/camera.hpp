#pragma once

#include "inputs.hpp"

#include <fathom/image.hpp>
#include <fathom/import_camera.hpp>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace fathom::cli {

/// The camera of the images: a file of any format that Fathom reads, a source of depth by name, both, or the headers
/// of the images.
struct CameraOption {
    std::string file;                                       ///< or the pattern of those of all frames
    std::string preset;                                     ///< NAME, NAME:key=value,... or key=value,...
    std::string image, node;                                ///< which camera of the file
    bool undistorted = false;                               ///< see ImportOptions
    std::function<const std::vector<Input>&()> inputs = {}; ///< whose headers may have cameras
    bool or_relative = false;                               ///< may the command do without?

    bool given() const { return !file.empty() || !preset.empty(); }
    std::string name() const; ///< for messages

    /// Is the camera of each input in its header?
    bool of_headers() const;

    /// Does each frame have a camera file of its own?
    bool is_pattern() const;

    /// Has each input a camera of its own, in its header or in a file?
    bool of_each_input() const { return of_headers() || is_pattern(); }

    /// The camera file of one input. Throws: UsageError where a pattern needs a frame that the input's name does not hold.
    std::string file_for(const Input& input) const;

    /// The files that the camera of one input is read from, without the input's own header.
    std::vector<std::filesystem::path> files_for(const Input& input) const;

    /// The camera of the first input that has one: refuses early what is wrong for all of them.
    /// Throws: UsageError where there is no camera, and Error for a camera that cannot be used. `first_counts`: also where
    /// the disk of an earlier input does not answer, which would have another input's camera stand for all.
    ImportedCamera read() const; ///< of all inputs, the first of which counts
    ImportedCamera read(std::vector<Input> depths, bool first_counts = false) const;

    /// Calls `use` with the camera of the first input that has what it needs, for which it throws no UsageError. A camera that
    /// cannot be read is told when all inputs are planned, or when the turn of its own comes.
    /// Throws: UsageError where there is no camera, and the first one of `use` where none has what it needs.
    void first_for(const std::function<void(const ImportedCamera&)>& use) const;

    /// The camera of one input, whose values are stored like this.
    ImportedCamera read_for(const Input& depth, Storage storage = Storage::float32) const;
};

} // namespace fathom::cli
