#pragma once

#include <fathom/fathom.hpp>

#include <vector>

namespace fathom::bench {

/// Float32 depth of the demo's room as this camera stores it.
std::vector<float> room_depth(const Camera& camera);

/// An image of the device's own, with these floats in it.
Image uploaded(const Device& device, Layout layout, const std::vector<float>& values);

} // namespace fathom::bench
