#pragma once

#include "json_object.hpp"

#include <fathom/camera.hpp>

#include <filesystem>
#include <functional>
#include <optional>

namespace fathom::io {

/// What "lens" of a camera file says.
struct LensKey {
    JsonObject own;
    std::filesystem::path rays = {}; ///< the file of a map of rays, which needs no model
    std::optional<LensLaw> law = {}; ///< none: a cube's face, which is a pinhole of 90 degrees

    /// A panorama and a cube's face need no projection beside them.
    bool has_projection() const { return !law || law == LensLaw::equirectangular || law == LensLaw::rays; }
};

/// What reads a map of rays. The libraries of files set it, since it is an image.
using RayReader = std::function<RayMap(const std::filesystem::path& file)>;
RayReader& ray_reader();

/// The lens; none where the file has none. Refused beside what only a projection has.
std::optional<LensKey> read_lens_key(const JsonObject& json, Encoding encoding);

/// "raw_lens", which the file has: the lens of the raw image, with "intrinsics" of its own.
LensKey read_raw_lens(const JsonObject& json);

/// OpenCV's 14 coefficients without the sensor's tilt, which the last two are, where that is 0.
std::vector<double> without_tilt(std::vector<double> k);

/// The lens itself for an image of this size, whose "intrinsics" are counted from the corner. Sizes that are not known yet are 1.
LensModel lens_model(const LensKey& key, const Intrinsics& intrinsics);

} // namespace fathom::io
