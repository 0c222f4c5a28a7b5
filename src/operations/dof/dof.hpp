#pragma once

#include "operations/dof/dof_layers.hpp"

#include <fathom/dof.hpp>

#include <cstddef>

namespace fathom {

/// Bytes between the passes of `dof`.
struct DofBytes {
    std::size_t band = std::size_t{200} << 20;        ///< that the images of a band of rows take, where that is enough
    std::size_t layer = sizeof(float) * layer_floats; ///< that a layer's own passes hand to one another, twice
};

/// Those that keep to a device's budget.
DofBytes dof_bytes(std::size_t budget);

/// `dof` itself, in bands of rows that take at most so many bytes where that is enough for a few rows. Same bits for any of them.
/// Throws: Error where a few rows take more than the budget.
void blur(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& coc,
          const DofOptions& options, const DofBytes& allowed);

} // namespace fathom
