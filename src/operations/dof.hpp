#pragma once

#include <fathom/dof.hpp>

#include <cstddef>

namespace fathom {

/// What lies between the passes of `dof`, but for what a layer's own passes hand to one another, takes about so many bytes.
inline constexpr std::size_t dof_band_bytes = std::size_t{200} << 20;

/// `dof`, in bands of rows that take at most `band_bytes` where that is enough for a few rows. Same bits for any of them.
void dof_in_bands(const StoredDepth& stored, const Image& color, const Image& result, const CircleOfConfusion& coc,
                  const DofOptions& options, std::size_t band_bytes);

} // namespace fathom
