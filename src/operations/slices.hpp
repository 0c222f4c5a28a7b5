#pragma once

#include "params.h"

#include <cstdint>
#include <vector>

namespace fathom {

/// Where the pixels of each of the 16 sampling jitter look, as kernels/ssao.cl reads it.
struct SliceTable {
    int slices;
    int samples;
    int levels; ///< radii of 2^(level/2) pixels, from 1 to `levels`
    std::vector<params::tap_params>
        taps; ///< [level − 1][pattern][slice][side][step], two steps more than `counts` says
    std::vector<float>
        turns; ///< [pattern][slice]: cosine and sine of the slice's direction on the screen, share of the
               ///< radius, rounding of its sectors
    std::vector<std::uint32_t> counts; ///< [level]: steps of a side; then of the same levels: planes' rows or columns
                                       ///< that they reach, and where their taps begin
};

/// Pixels in a row or column of an image, at most: a quarter of them is a tap's offset, in 16 bits.
constexpr int longest_side = 130000;

/// How a split image lies in memory: elements from row to row and from plane to plane.
struct PlaneLayout {
    int stride, plane;
};

/// Pure: no device. Even numbers of slices without noise are invariant under quarter turns and mirrors.
SliceTable slice_table(int slices, int samples, int largest_radius, int patterns, double falloff, std::uint32_t seed,
                       PlaneLayout place);

} // namespace fathom
