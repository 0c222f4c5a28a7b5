#pragma once

#include <string>
#include <vector>

/// Sources of depth by name: what their stored values mean. Target `fathom::camera_file`.
namespace fathom {
#pragma GCC visibility push(default)

/// What a camera file says that names this source: `"preset": "carla"`. Keys that stand in the file itself come first.
struct Preset {
    /// A key that the source leaves open.
    struct Need {
        std::string key;
        std::string meaning; ///< "the near plane, in metres"
    };

    std::string name;
    std::string source;  ///< what writes such depth, for people
    std::string formula; ///< z, the distance along the view axis, from a stored value v
    std::string keys;    ///< JSON: keys of the camera file (docs/camera.md)
    /// The key of the projection that people have: fov_x_deg, fov_y_deg or fx; empty for panoramas.
    std::string projection = {};
    std::string usual = {}; ///< what that key usually is; empty where nothing is usual
    std::vector<Need> needs = {};
    bool is_distorted = false;  ///< by a lens that the camera file has to say
    double usual_metres = 1000; ///< beyond which it has hardly half of its depths, where the formula counts in metres
};

/// All sources, in alphabetical order of their names.
const std::vector<Preset>& presets();

#pragma GCC visibility pop
} // namespace fathom
