#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/quality.hpp>

#include <variant>

namespace fathom {
#pragma GCC visibility push(default)

/// How the slope of a surface is found.
enum class NormalMethod {
    automatic,     ///< least squares for depth stored in 16 bits or fewer and for noise, neighbours otherwise
    neighbours,    ///< from two neighbours on either side, per axis: the side that predicts the pixel, or both sides
    least_squares, ///< from a plane fitted to a window's pixels that lie on it up to rounding: for quantised depth
};

struct NormalsOptions {
    std::variant<NormalMethod, MaxError> method = NormalMethod::automatic; ///< or a mean error in degrees
    Space space = Space::view;
    int channels = 3;     ///< 3 or 4, with the validity: 1, and 0 where there is no normal
    double tolerance = 1; ///< how far depth may be off, in half steps of its storage
    /// Standard deviation of a sensor's noise over the depth, such as 9e-4, independent from pixel to pixel: 0
    /// to less than 1. Least squares then fit planes to a window as wide as `normals_noise_error_deg` asks for.
    double noise = 0;
};

/// Pixels on either side that a normal is made from.
inline constexpr int normals_reach_neighbours = 2;
inline constexpr int normals_reach_least_squares = 3;
inline constexpr int normals_reach_noise = 8; ///< of least squares with `noise`, at most

/// Error of the slopes of inverse depth (1/z; z for an orthographic camera) on a plane, two pixels away from everything else:
/// at most this many times the error bound of inverse depth itself, per pixel, at any tilt. That bound is half a step of the
/// stored depth and four roundings. As an angle it is about `normals_slope_error` · (z's relative error) / (a pixel's angle).
inline constexpr double normals_slope_error = 0.6;

/// Mean error, in degrees, that `noise` leaves of a wall that faces a perspective camera, away from its edges: the smallest
/// window with no more is taken, of 3, 5 or 8 pixels on either side. Beyond some noise the largest has more.
inline constexpr double normals_noise_error_deg = 1.5;

/// A normal's length is 1 within this.
inline constexpr double normals_length_error = 4 * 0x1p-24;

/// Normals from stored depth (or from view depth, through `ViewDepth::stored`), in two passes.
///
/// In: one stored value a pixel. Out: x, y, z (and the validity) interleaved floats in the projection's axes or in the
/// world's, of unit length, towards the camera under every projection. Invalid and background pixels have (0, 0, 0) and
/// validity 0. A pixel without a neighbour along an axis is taken to face the image plane along it. Borders are one-sided. A
/// region has the bits of the whole, except within reach of its border.
/// Neighbours: if both sides predict the pixel, their mean is used. At an edge or a crease one side predicts it and is used.
/// Least squares: the fit takes pixels that lie on the plane up to the rounding of stored values (half a step of the storage,
/// or of `camera.depth_bits`), which removes noise and keeps edges. If rounding is small, as on a curved surface of float
/// depth, the result is the neighbours' normal.
/// Accuracy: `normals_slope_error`, `normals_length_error`; with noise `normals_noise_error_deg`.
/// `inexact::normals_error` more on a device that is not exact (probe.hpp).
/// Throws: std::invalid_argument for options out of range, for world space without a view matrix, and for noise together
/// with a `MaxError`.
/// Source: two-tap extrapolation by atyuwen, "Accurate Normal Reconstruction from Depth Buffer", 2020; that 1/z is affine on
/// the screen, Blinn 1992; both for every camera as derived in kernels/normals/normals.cl and docs/camera.md.
Image normals(const StoredDepth& stored, const NormalsOptions& options = {}, const Launch& launch = {});

/// The same into an image of the caller's: `options.channels` floats a pixel, the size of the depth, with any row stride.
/// It shares no memory with the depth.
void normals(const StoredDepth& stored, const Image& result, const NormalsOptions& options = {},
             const Launch& launch = {});

#pragma GCC visibility pop
} // namespace fathom
