#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>

namespace fathom {
#pragma GCC visibility push(default)

struct LinearizeOptions {
    Background background = Background::inf; ///< what the background's stored value becomes
    Along as = Along::axis;                  ///< the view axis, or the pixel's ray: distance from the camera centre
};

/// Decoded depth is within this many units in the last place of the exact value of the stored number, plus
/// `sum_condition_fp64` (or `_two_float`) times the condition κ = Σ|terms|/|sum| of the form's own sum.
inline constexpr double linearize_ulp_fp64 = 1.0;
inline constexpr double linearize_ulp_two_float = 2.0;
inline constexpr double linearize_ulp_exponential = 2.0;
inline constexpr double linearize_ulp_ray_distance = 1.0;
inline constexpr double sum_condition_fp64 = 0x1p-52;
inline constexpr double sum_condition_two_float = 0x1p-46;

/// Ray distance from a camera centre away from the origin adds the centre's own depth. That sum adds this times κ.
inline constexpr double sum_condition_ray_distance = 0x1p-34;

/// Smallest stored value for which the exponential forms keep that promise with the two-float path: below it the low
/// part of a pair is lost among the denormals.
inline constexpr double exponential_least_two_float = 0x1p-100;

/// View-space depth from stored depth, in one pass, whatever the projection, encoding and storage.
///
/// In: one stored value a pixel. Out: one float a pixel, scene units along the view axis, positive in front of the camera.
/// Along the ray it is the distance from the camera centre; an orthographic camera has none, and it counts from its origin.
/// Background becomes +inf (or what `options.background` says); NaN, values outside the stored range and, for a
/// perspective, z ≤ 0 become NaN. Rows stay in the order of the input. Same bits for any vector width, group size or region.
/// Accuracy: `linearize_ulp_fp64`, `linearize_ulp_two_float`, `linearize_ulp_exponential`, `linearize_ulp_ray_distance`,
/// and the condition terms above; `inexact::linearize_ulp` more on a device that is not exact (probe.hpp).
/// Throws: std::invalid_argument for a camera that does not fit the image or cannot be decoded; Error from the device.
/// Source: Popov 2016, eq. 1, 3 and 5–9, as derived in docs/camera.md.
ViewDepth linearize(const StoredDepth& stored, const LinearizeOptions& options = {}, const Launch& launch = {});

/// The same into an image of the caller's: one float a pixel, the size of the depth, with any row stride. `stored.image`
/// itself is written in place if it holds float32, which halves the memory traffic. No other image may share memory with it.
void linearize(const StoredDepth& stored, const Image& result, const LinearizeOptions& options = {},
               const Launch& launch = {});

/// The depth of the surface at a pixel of the image, for `Lens::focus`; infinity for the background. Through a lens other than
/// `brown`, which has a sphere in focus, it is the distance along the ray.
/// Throws: std::invalid_argument for a pixel outside the image, or whose stored value is invalid.
double depth_at(const StoredDepth& stored, int x, int y);

/// Stored depth without holes: an invalid pixel takes the value of the nearest valid pixel to its left or to its right, the
/// farther one of the two. In a row without valid pixels it takes that above or below. Holes in measured depth lie mostly
/// beside an edge, where a sensor's light or the second camera did not reach: behind it.
/// Throws: std::invalid_argument for a camera that does not fit the image or cannot be decoded; Error from the device.
StoredDepth fill_invalid(const StoredDepth& stored);

/// The same into an image of the caller's, of the size and type of `stored.image`, which it may be. Waits for the device.
void fill_invalid(const StoredDepth& stored, const Image& result);

/// The most pixels that `grow_foreground` takes.
inline constexpr int most_grown_pixels = 16;

/// Stored depth whose near surfaces are larger by some pixels: a pixel takes the stored value of the nearest surface among the
/// pixels whose centres are at most so many pixels away. Depth that is soft, or that lies a few pixels beside its picture's edges,
/// then covers all of a foreground that `dof` blurs. Invalid pixels stay invalid, and nothing takes their value; the background
/// is farther than all else. With 0 pixels no bit changes. A tile with as many pixels around it has the bits of the whole.
/// Throws: std::invalid_argument for more than `most_grown_pixels` or less than 0, and for a camera that does not fit the image or
/// cannot be decoded; Error from the device.
StoredDepth grow_foreground(const StoredDepth& stored, int pixels);

/// The same into an image of the caller's, of the size and type of `stored.image`, which it may be. Waits for the device.
void grow_foreground(const StoredDepth& stored, const Image& result, int pixels);

/// Stored depth in which pixels do not count where `ignore` is not 0: they become invalid, and no other pixel changes. Floats
/// become NaN, and integers the code that the camera calls `missing`. Where it names none, the result's camera names the largest
/// code that no pixel has.
/// In: `ignore` of the depth's size, one number a pixel of any type; NaN is not 0. Waits for the device.
/// Throws: std::invalid_argument for an image that does not fit; Error where all codes are used, and from the device.
StoredDepth ignore_pixels(const StoredDepth& stored, const Image& ignore);

/// Depth of the size of a picture that shows the same, for `fog`, `dof` and `dof_masks`: `upsample_along_edges` of photograph.hpp
/// for the distance along the axis, as a mean of 1/z under a perspective, which is exact on a plane. A pixel is background or invalid
/// where most of the depths around it are. The camera maps the whole image, and becomes that of the picture's pixels.
/// In: the whole of an image, and a picture with 3 or 4 channels in linear light: floats, halves, or integers of 8 or 16 bits that
/// count from 0 to 1. Waits for the device, and computes on the host, in one thread.
/// Throws: std::invalid_argument for another picture, and for ratios of width to height that differ by more than a pixel; Error from
/// the device.
StoredDepth upsample_along_edges(const StoredDepth& stored, const Image& color);

/// Depth that ramps from one surface to the next over a few pixels, as that of networks, averaged and upsampled depth does, with hard
/// edges: each pixel of a ramp gets about the depth of the surface on one of its two sides. A picture decides on which, and gives back
/// the depth of what is narrower than a ramp. All other pixels keep their depths, and all of them do where most edges are hard already,
/// as those of exact depth are: then the result is `stored` itself. Where most edges have pixels whose distance, or value in a depth
/// buffer, is a mean of both sides, as renderers average it, such a pixel gets the depth of the side that has most of it.
/// In: the whole of an image, and its picture with 3 or 4 channels in linear light, of the same size. `changed`: an image of bytes of
/// that size, or none, which gets 1 for each pixel with another depth, and 0 for all others. Waits for the device, and computes on the
/// host. Accuracy: docs/depth-of-field.md, "Soft edges".
/// Throws: std::invalid_argument for another picture or image; Error from the device.
StoredDepth sharpen_edges(const StoredDepth& stored, const Image& color = {}, const Image& changed = {});

/// A pixel depends on nothing around it, and a call takes no memory of its own; see tiles.hpp.
inline Reach reach(const Tile&, const LinearizeOptions&) {
    return {};
}
inline std::size_t bytes(const Tile&, const LinearizeOptions&) {
    return 0;
}

#pragma GCC visibility pop
} // namespace fathom
