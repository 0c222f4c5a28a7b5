#pragma once

#include <cstdint>
#include <vector>

namespace fathom {

/// Where the pixels of each of the 16 sampling patterns look, as kernels/ssao.cl reads it.
struct SliceTable {
    int slices;
    int steps;
    int levels;                        ///< radii of 2^(level/2) pixels, from 1 to `levels`
    std::vector<float> taps;           ///< [level − 1][pattern][slice][side][step]: plane, offset, distance, aside
    std::vector<float> turns;          ///< [pattern][slice]: cosine and sine of the slice's direction on the screen
    std::vector<std::uint32_t> counts; ///< [level]: steps of a side
};

/// Pure: no device. Even numbers of slices without noise are invariant under quarter turns and mirrors.
SliceTable slice_table(int slices, int steps, int largest_radius, int patterns, std::uint32_t seed);

} // namespace fathom
