#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/required.hpp>

#include <Eigen/Core>

#include <array>

namespace fathom {
#pragma GCC visibility push(default)

/// What fog does to the background.
enum class FogSky {
    fog,  ///< the background is infinitely far away
    keep, ///< the background keeps its colour
};

/// How a colour with four channels holds its alpha.
enum class FogAlpha {
    premultiplied, ///< the colour is multiplied by its alpha, and so is the fog's colour then
    straight,      ///< the colour is not
};

struct FogOptions {
    Required density;       ///< fraction of the light lost per scene unit, over a short way; from 0
    double max_opacity = 1; ///< no pixel is fogged more than this, 0 to 1
    double start = 0;       ///< distance along the ray at which the fog begins, scene units; from 0
    std::array<double, 3> fog_color{0.5, 0.6, 0.7}; ///< in the picture's (linear) values and order of channels

    /// Height fog: density(h) = density · exp(−height_falloff · (h − reference_height)), h the height along `up` in the
    /// world. 0: the same density everywhere. Needs the camera's view matrix otherwise.
    double height_falloff = 0;   ///< per scene unit; from 0
    double reference_height = 0; ///< where the density is `density`
    Eigen::Vector3d up{0, 1, 0}; ///< the world's up axis, of any length

    FogSky sky = FogSky::fog;
    FogAlpha alpha = FogAlpha::premultiplied;
    bool whole_pixels = false; ///< does each pixel of the picture show one surface, as without antialiasing?
};

/// The result is within this of the exact one for the given view depth, in the larger of the two colours.
inline constexpr double fog_error = 4 * 0x1p-24;

/// Exponential or height fog over a picture, from stored depth in one pass.
///
/// In: one stored value a pixel, and a picture of the depth's size with 3 or 4 channels: floats, halves, or integers of 8 or
/// 16 bits that count from 0 to 1. Out: an image of the picture's type.
///   f = min(1 − exp(−τ), max_opacity),  result = color · (1 − f) + fog color · f
/// τ is the integral of the density over the distance along the ray (not over z), from `start` to the surface. It is in closed
/// form, and exact for small densities and level rays too. Rays of an orthographic camera start at view depth 0.
/// A pixel at an edge in depth is mixed of two colours if the picture is antialiased: each gets its own side's fog, unless
/// `whole_pixels` says that no pixel is mixed.
/// The alpha stays as it is. A pixel with an invalid depth keeps its colour, and so does a value that is not finite. The
/// background is infinitely far: uniform fog hides it, height fog hides it along level rays and downwards; see `sky`.
/// Same bits for any vector width, group size and region.
/// Accuracy: `fog_error`, for floats, of pixels that show one surface; `inexact::fog_error` more on a device that is not exact (probe.hpp).
/// Throws: std::invalid_argument for options out of range, images that do not fit or share memory, and height fog of a
/// camera without a view matrix; Error from the device.
/// Source: Wenzel 2006, "Real-time Atmospheric Effects in Games" (height fog in closed form).
Image fog(const StoredDepth& stored, const Image& color, const FogOptions& options, const Launch& launch = {});

/// The same into an image of the caller's: of the picture's type and size, not sharing memory with the inputs.
void fog(const StoredDepth& stored, const Image& color, const Image& result, const FogOptions& options,
         const Launch& launch = {});

/// How far around a pixel with two colours is looked, in pixels.
inline constexpr int fog_reach = 2;

/// A call takes no memory of its own; see tiles.hpp.
inline Reach reach(const Tile&, const FogOptions& options) {
    return options.whole_pixels ? Reach{} : Reach{fog_reach, fog_reach};
}
inline std::size_t bytes(const Tile&, const FogOptions&) {
    return 0;
}

#pragma GCC visibility pop
} // namespace fathom
