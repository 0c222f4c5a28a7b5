#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>

#include <optional>

namespace fathom {

/// How the slope of a surface is found.
enum class NormalMethod {
    automatic,     ///< least squares for depth stored in 16 bits or fewer, neighbours otherwise
    neighbours,    ///< two neighbours on either side, per axis: the side that predicts the pixel, or both
    least_squares, ///< a plane fitted to the window's pixels that rounding alone keeps off it: for quantised depth
};

struct NormalsOptions {
    NormalMethod method = NormalMethod::automatic;
    /// Instead of it: the mean error in degrees that the choice may have in the scenes of docs/performance.md, and the
    /// cheapest that has no more is taken (`cheapest_method` of choice.hpp).
    std::optional<double> max_error = {};
    Space space = Space::view;
    int channels = 3;     ///< 3, or 4 with the validity: 1, and 0 where there is no normal
    double tolerance = 1; ///< what depth may be off by, in half steps of its storage: more for a sensor that is noisier
};

/// Pixels on either side that a normal is made from.
inline constexpr int normals_reach_neighbours = 2;
inline constexpr int normals_reach_least_squares = 3;

/// On a plane, two pixels away from everything else, the slopes of inverse depth (1/z; z for an orthographic camera) are off by
/// no more than this many times the bound of its own error, a pixel, however the plane is tilted: half a step of the stored
/// depth and four roundings. As an angle that is about `normals_slope_error` · (z's relative error) / (a pixel's angle).
inline constexpr double normals_slope_error = 0.6;

/// A normal's length is 1 within this.
inline constexpr double normals_length_error = 4 * 0x1p-24;

/// Normals from stored depth (or from view depth, through `ViewDepth::stored`), in two passes.
///
/// In: one stored value a pixel. Out: x, y, z (and the validity) interleaved floats in the projection's axes or in the
/// world's, unit length, towards the eye whatever the projection. A pixel that is no surface, background included, has
/// (0, 0, 0) and validity 0. One that has no neighbour along an axis is taken to face the image plane along it.
/// Borders are one-sided. A region has the bits of the whole, but within reach of its border.
/// Neighbours: where both sides predict the pixel, their mean; at an edge or a crease the side that does. Least squares:
/// pixels within the stored values' rounding of the plane (half a step of the storage, or of `camera.depth_bits`), so
/// that noise goes and edges stay; where rounding is small, on a curved surface of float depth say, what is left is the
/// neighbours' normal.
/// Accuracy: `normals_slope_error`, `normals_length_error`.
/// Throws: std::invalid_argument when the world is asked of a camera without a view matrix, or for channels other than 3, 4,
/// and for a tolerance that is not above 0.
/// Source: two-tap extrapolation by atyuwen, "Accurate Normal Reconstruction from Depth Buffer", 2020; that 1/z is affine on
/// the screen, Blinn 1992; both for every camera as derived in kernels/normals.cl and docs/camera.md.
Image normals(const StoredDepth& stored, const NormalsOptions& options = {}, const Launch& launch = {});

/// The same into an image of the caller's: `options.channels` floats a pixel, the size of the depth, with any row stride.
/// It shares no memory with the depth.
void normals(const StoredDepth& stored, const Image& result, const NormalsOptions& options = {},
             const Launch& launch = {});

} // namespace fathom
