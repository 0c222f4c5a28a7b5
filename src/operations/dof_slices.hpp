#pragma once

#include "operations/dof_aperture.hpp"

#include "params.h"

#include <array>
#include <span>
#include <vector>

namespace fathom {

/// Slices of circle of confusion, evenly spaced within an octave: number `middle` has the circles up to one pixel.
struct SliceScale {
    int per_octave;
    int middle;

    int count() const { return 2 * middle + 1; }
    double circle(int slice) const; ///< signed, in pixels; ±1 in the middle
};

/// The scale for circles of up to `largest_px`; at most 159 slices.
SliceScale slice_scale(int per_octave, double largest_px);

/// Bits of the slices that a tile's pixels lie in; the last one: some colour is beyond the knee.
using TileBits = std::array<params::u32, 5>;

inline bool has_bit(const TileBits& tile, int bit) {
    return (tile[static_cast<std::size_t>(bit / 32)] >> (bit % 32) & 1) != 0;
}

/// A launch of kernels/dof_strips.cl, unless the pixels are read directly, and of kernels/dof_gather.cl. Where pixels are read
/// directly and the quality is not accurate, a launch is of several slices, the first in `gather`: after its tile an entry of
/// the list has a bit for each that reaches it, and a bit for each that follows one that does; at `starts` stand where a
/// slice's own starts begin, and its reach.
struct SlicePass {
    params::slice_params strips, gather;
    params::part_params part; ///< accurate only
    bool direct, fill, bright;
};

/// What the passes of dof do, in order, and the tables they read.
struct SlicePlan {
    std::vector<SlicePass> passes;
    std::vector<params::u32> lists; ///< tiles: column, and row in the high half
    std::vector<params::u32> starts;
    std::vector<params::span_params> spans;
    std::vector<params::tap_share_params> taps; ///< accurate only
    std::size_t strip_elements = 1;             ///< that the largest pass needs
};

struct SlicePlanOptions {
    Aperture aperture;
    SliceScale scale;
    double aspect = 1;
    bool upright = true;
    BlurQuality quality = BlurQuality::standard;
    int channels = 3;
};

inline constexpr int tile_columns = 64, tile_rows = 8; // kernels/tiles.h

/// Which tiles each slice reaches, front to back. Pure: no device.
SlicePlan slice_plan(std::span<const TileBits> tiles, int across, const SlicePlanOptions& options);

} // namespace fathom
