#pragma once

#include "scene/scene.hpp"

#include <fathom/fathom.hpp>

#include <vector>

namespace fathom::bench {

/// Window depth of a scene, not rounded, for timing: planes are exact, and what is narrower than 8 pixels may be missed.
std::vector<double> stored_depth_of(const scene::Scene& scene, const Camera& camera);

/// Float32 depth of the demo's room as this camera stores it.
std::vector<float> room_depth(const Camera& camera);

/// An image of the device's own, with these floats in it.
Image uploaded(const Device& device, Layout layout, const std::vector<float>& values);

} // namespace fathom::bench
