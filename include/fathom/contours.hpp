#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/required.hpp>

namespace fathom {
#pragma GCC visibility push(default)

struct ContoursOptions {
    Required step; ///< distance between two contour lines, scene units; above 0
};

/// A depth of t steps lies within this times t of its exact place: the decoder's rounding, and two of the quotient.
inline constexpr double contours_error = 4 * 0x1p-24;

/// Where depth lies between two contour lines: 0 on the nearer one, and below 1.
///
/// In: one stored value a pixel. Out: one float a pixel. Invalid pixels and the background are NaN.
/// Accuracy: `contours_error`.
/// Throws: std::invalid_argument for a step out of range, or a camera that does not fit the image; Error from the device.
Image contours(const StoredDepth& stored, const ContoursOptions& options, const Launch& launch = {});

/// The same into an image of the caller's: one float a pixel, the size of the depth, not sharing memory with it.
void contours(const StoredDepth& stored, const Image& result, const ContoursOptions& options,
              const Launch& launch = {});

/// A pixel depends on nothing around it, and a call takes no memory of its own; see tiles.hpp.
inline Reach reach(const Tile&, const ContoursOptions&) {
    return {};
}
inline std::size_t bytes(const Tile&, const ContoursOptions&) {
    return 0;
}

#pragma GCC visibility pop
} // namespace fathom
