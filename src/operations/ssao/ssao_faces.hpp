#pragma once

#include "operations/ssao/ssao_call.hpp"

#include <vector>

namespace fathom {

/// Do two cameras see along the same rays through their lenses?
bool same_lens(const Camera& a, const Camera& b);

/// Occlusion through a lens: by pinholes that see a block of the image each. Waits for the device.
/// Throws: Error where the device's budget is too small.
void occlude_through_lens(const StoredDepth& stored, double radius, const SsaoOptions& options,
                          const std::vector<Wanted>& results);

/// The most bytes that this takes for itself, however near surfaces come.
std::size_t bytes_through_lens(const Tile& tile, const SsaoOptions& options);

} // namespace fathom
