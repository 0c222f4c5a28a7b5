#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/quality.hpp>
#include <fathom/unproject.hpp>

#include <cstdint>
#include <optional>
#include <variant>

namespace fathom {
#pragma GCC visibility push(default)

/// What lies outside the image.
enum class Border {
    open,  ///< nothing
    clamp, ///< the pixels of its border, again and again
};

/// How many directions and distances are looked into: a quality, and what takes the place of its own numbers.
struct Sampling {
    Quality quality = Quality::balanced;
    std::optional<int> slices = {};  ///< planes through the view ray, 1 to 64
    std::optional<int> samples = {}; ///< samples on either side of a slice, 1 to 256
    /// Up to how many times as many samples long rays take, 1 to 8: they grow with the square root of the radius beyond 48 pixels.
    /// Default: 1, or 2 for `accurate`, and more where a quality chooses half resolution.
    std::optional<double> growth = {};
    /// 1, 4 or 16 neighbouring pixels turn and shift their slices and samples, and are averaged over as many afterwards. 1 turns
    /// both off.
    std::optional<int> jitter = {};

    /// Computes every second pixel of every second row of the camera's image and interpolates the others along their tangent
    /// planes. A pixel without a valid computed neighbour is open, with a confidence of 0. true: everywhere; false: nowhere.
    /// Default: a quality chooses it for each block of 64 x 64 pixels of the camera's image, where the radius covers many
    /// pixels, and takes more slices and samples there.
    /// With `slices`, `samples`, `growth` or `jitter` the default is false.
    std::optional<bool> half_resolution = {};
};

/// Each object is as thick as it is wide in the image.
struct Silhouette {};

/// How thick surfaces are along their rays: the same everywhere, in scene units, where infinity makes everything behind a surface
/// solid, as in a height field; a thickness for each pixel, one float, of the depth's size; each pixel as thick as its object is
/// wide; or where each pixel's solid ends, a second layer of depth of the same size. A pixel whose end is NaN or lies in front of its
/// surface is a quarter of the radius thick.
using Thickness = std::variant<double, Image, Silhouette, StoredDepth>;

struct SsaoOptions {
    std::variant<Sampling, MaxError> sampling = {}; ///< or a root mean square error of visibility
    std::optional<Thickness> thickness = {};        ///< default: Silhouette

    double falloff = 0; ///< 0 to 1: fraction of the radius, at its end, over which occluders fade out; 0: a hard end
    Border border = Border::open;
    std::uint32_t seed = 0; ///< another number gives another pattern of jitter

    std::optional<Region> region = {}; ///< part that is computed; samples still come from the whole image

    double tolerance = 1; ///< how far depth may be off, in half steps of its storage: more for a noisy sensor. Surfaces
                          ///< stay open, and normals are fitted likewise if none are given
    /// 3 or 4 floats a pixel, of length 1. Where that is off by 0.02, as in a renderer's mean over an edge, or where a vector
    /// is (0, 0, 0) or faces away, the normal comes from depth, as everywhere by default. Strands have none there: a mean of a
    /// length from 0.5 counts on them.
    Image normals = {};
    Space normals_space = Space::view; ///< axes of these normals

    // Which results of `Occlusion` are wanted, besides visibility?
    bool bent_normal = false;
    bool confidence = false;
};

/// Bounds of a thickness from the silhouette, as fractions of the radius. A run to the image's border counts as the most. The
/// halo that makes a tile bit-identical is longer by the most.
inline constexpr double silhouette_least = 0.01, silhouette_most = 0.5;

/// A surface that lies deeper behind a pixel than this fraction of the radius, and deeper than it lies aside, is beyond the
/// silhouette of the pixel's object.
inline constexpr double silhouette_step = 0.02;

/// Largest difference from 1 of the visibility of a plane that nothing rises above.
inline constexpr double ssao_plane_error = 0.002;

/// Results of `ssao`, of the size of the depth image or of the region.
struct Occlusion {
    Image visibility;  ///< one float: 1 open, 0 blocked
    Image bent_normal; ///< three floats, unit length, view space: mean of the open directions,
                       ///< weighted by the cosine
    Image confidence;  ///< one float: fraction of samples that hit valid pixels inside the image; with
                       ///< Border::clamp the repeated pixels count as valid
};

/// Ambient occlusion from depth alone: the fraction of the hemisphere above each pixel's surface, weighted by the cosine,
/// in which a ray of length `radius` meets nothing that the image shows.
///
/// In: one stored value a pixel, and the length of the rays in scene units. Objects farther away than `radius` occlude
/// nothing. Out: visibility from 0 to 1. The background has visibility 1, bent normal (0, 0, 0) and confidence 1. Invalid
/// pixels have NaN in every result. A radius of less than a pixel gives 1.
/// Accuracy: `ssao_plane_error` for a surface that nothing rises above, under every camera and at tilts to 80°;
/// `inexact::ssao_error` more on a device that is not exact (probe.hpp).
/// Throws: std::invalid_argument for a radius that is not above 0 or not finite, for options out of range, for images whose size
/// does not fit and for Border::clamp through a lens; Error from the device, and for a budget that an image through a lens does
/// not fit into.
/// Source: slices and their measure, Jimenez et al. 2016; sectors as bits, Therrien et al. 2023.
Occlusion ssao(const StoredDepth& stored, double radius, const SsaoOptions& options = {}, const Launch& launch = {});

/// The same into the caller's images: visibility, and the images that `options` asks for, with any row stride. They share
/// memory neither with an input nor with each other. An image that is not asked for is refused.
void ssao(const StoredDepth& stored, const Occlusion& results, double radius, const SsaoOptions& options = {},
          const Launch& launch = {});

#pragma GCC visibility pop
} // namespace fathom
