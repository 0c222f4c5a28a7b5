#pragma once

#include <fathom/image.hpp>
#include <fathom/lens_arguments.hpp>

/// Frames that are rendered larger than their results, so that each pixel of a result is the mean of a square of pixels: an operation
/// takes depth and picture of the large frame, with `supersampled` of the small one's camera and lens, and `average_squares` makes
/// the small result of its large one.
namespace fathom {
#pragma GCC visibility push(default)

inline constexpr int most_supersampled = 4;

/// The camera of an image that shows the same in `factor` times as many pixels each way.
/// Throws: std::invalid_argument for a factor other than 1 to `most_supersampled`, and for a lens that is a map of rays, which has one
/// ray for each pixel of the small image.
Camera supersampled(const Camera& camera, int factor);

/// The lens for such an image, in whose pixels `circle` and `blur_px` then count. A pixel of `focus_at` and `focus_along` becomes the
/// middle one of its square. Throws: std::invalid_argument for such a factor, and for a pixel that lies outside every image.
LensArguments supersampled(LensArguments lens, int factor);

/// Means over squares of N × N pixels, N being the width of `large` over that of `small`, any whole number. NaN is left out; where all
/// of a square is NaN, so is its mean. `directions`: means of vectors get the length 1 again, or are 0 where they cancel.
/// In and out: images of one element type and as many channels, in linear light where they are light. Waits for the device, and
/// computes on the host. Accuracy: half a unit in the last place, and 2 of directions.
/// Throws: std::invalid_argument for images that do not fit; Error from the device.
void average_squares(const Image& large, const Image& small, bool directions = false);

#pragma GCC visibility pop
} // namespace fathom
