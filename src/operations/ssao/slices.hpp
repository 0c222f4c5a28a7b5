#pragma once

#include "params.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace fathom {

/// How many slices and samples there are on the screen.
struct Counts {
    int slices, samples, jitter;
    double growth; ///< times as many samples, at most, for long rays
};

/// Where the pixels of each of the 16 jitter patterns are sampled, as kernels/ssao/ssao.cl reads it.
struct SliceTable {
    int slices;
    int levels; ///< radii of 2^(level/2) pixels, from 1 to `levels`
    /// [level − 1][pattern][slice][side][sample]. Before the samples that `counts` counts stands the pixel itself, behind them
    /// one more sample.
    std::vector<params::tap_params> taps;
    /// [pattern][slice]: cosine and sine of the slice's direction on the screen, its fraction of the radius, and the rounding
    /// of its sectors.
    std::vector<float> turns;
    /// [level]: samples of a side. Then, for the same levels: how many rows or columns of a plane the samples reach. Then:
    /// where the samples of a level begin in `taps`.
    std::vector<std::uint32_t> counts;
};

/// Pixels in a row or column of an image, at most: a quarter of them is a tap's offset, in 16 bits.
constexpr int longest_side = 130000;

/// How a split image lies in memory: elements from row to row and from plane to plane.
struct PlaneLayout {
    int stride, plane;
};

/// Pure: no device. Even numbers of slices without jitter are invariant under quarter turns and mirrors.
SliceTable slice_table(const Counts& counts, int largest_radius, double falloff, std::uint32_t seed, PlaneLayout place);

/// Bytes of such a table.
std::size_t slice_table_bytes(const Counts& counts, int largest_radius);

} // namespace fathom
