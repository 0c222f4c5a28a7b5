#pragma once

#include <fathom/findings.hpp>

#include <optional>
#include <string>
#include <vector>

/// What the values of a depth image could be, where nobody says it. Needs no device. Target `fathom::camera`.
namespace fathom {
#pragma GCC visibility push(default)

/// How stored values depend on the distance.
enum class Family {
    window_affine, ///< depth-buffer values: affine in 1/z under a perspective, in z under an orthographic projection
    planar,        ///< affine in the distance along the view axis: metric or linear depth
    radial,        ///< proportional to the distance along the pixel's ray
    inverse,       ///< affine in 1/z and greater where it is nearer: disparity, inverse depth
    other,         ///< logarithmic or exponential
};

const char* to_string(Family family);

/// One reading of the values.
struct Guess {
    Family family = Family::other;
    std::string meaning;     ///< "distance along the view axis; millimetres are plausible"
    double fits = 0;         ///< fraction of the flat patches over which this reading makes planes of planes
    std::string camera_file; ///< JSON to start from
    std::string assumed;     ///< what in `camera_file` is no finding: "fov_y_deg, near and far"
};

/// What an image's values could be.
struct Ranking {
    std::optional<Family> family;      ///< none: cannot tell
    std::vector<std::string> evidence; ///< a sentence each
    std::vector<Guess> guesses;        ///< the likely ones first; of two that the evidence does not separate both
};

/// Ranks what the stored values could be. Flat patches of the image tell what is affine in the pixel over a plane:
/// stored values for depth buffers and inverse depth, 1/v for depth along the axis, |ray|/v for depth along the ray.
/// The range of the values tells the rest, with the values that stand apart, such as the sky's, and silhouettes.
/// Pixels are taken as square, and the optical axis as in the middle of the image. Invalid pixels are left out. Where
/// the evidence does not decide, no family is named. Takes less than a second for 1920 x 1080 pixels.
/// Throws: std::invalid_argument for an image without pixels. Source: docs/inspect.md.
Ranking rank_encodings(const HostDepth& stored);

#pragma GCC visibility pop
} // namespace fathom
