#pragma once

#include "sweeps.hpp"

namespace fathom::bench {

/// Every operation, camera and formula against the copy that moves the same bytes: on frames of random depths, far/near = 10⁶;
/// `ssao` in a room of the same size, `dof` in one of 1920 × 1080. `frames`: to go through in turn; 0: enough to outgrow a cache
/// of half a gigabyte. Rows with `effort.only` in their names run in every round, those that take long run less often otherwise.
std::vector<Figures> operations(const Device& device, Size size, int frames, const Effort& effort);

} // namespace fathom::bench
