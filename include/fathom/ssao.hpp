#pragma once

#include <fathom/image.hpp>
#include <fathom/launch.hpp>
#include <fathom/quality.hpp>
#include <fathom/unproject.hpp>

#include <cstdint>
#include <optional>

namespace fathom {

/// What lies outside the image.
enum class Border {
    open,  ///< nothing
    clamp, ///< the pixels of its border, again and again
};

struct SsaoOptions {
    Quality quality = Quality::balanced; ///< how many directions and distances are looked into
    std::optional<int> slices = {};      ///< instead of the quality's: planes through the view ray, 1 to 64
    std::optional<int> samples = {}; ///< instead of the quality's: places looked at on either side of a slice, 1 to 256
    std::optional<int> jitter =
        {}; ///< instead of the quality's: 1, 4 or 16 shifts of slices and steps among neighbouring
            ///< pixels, averaged over as many afterwards; 1: every pixel alike, nothing averaged

    /// Instead of all these, and of half_resolution: the root mean square error of visibility that the choice may have in the
    /// scenes of docs/performance.md, and the cheapest that has no more is taken (`cheapest_method` of choice.hpp).
    std::optional<double> max_error = {};

    /// What is solid behind a surface, along its ray, scene units; default: a quarter of the radius; infinity: all that
    /// lies behind it, a height field.
    std::optional<double> thickness = {};
    Image thickness_map = {};                   ///< the same for each pixel: one float, same size as the depth
    std::optional<StoredDepth> back_depth = {}; ///< where each pixel's solid ends: a second layer of depth, same size

    double falloff = 0; ///< 0 to 1: share of the radius, at its end, over which occluders fade out; 0: a hard end
    Border border = Border::open;
    std::uint32_t seed = 0; ///< turns the jitter

    /// Look from every second pixel of every second row of the camera's image alone, and let all others have what those
    /// beside them have, along their tangent planes: for large radii. What has none beside it on a surface is open, with a
    /// confidence of 0.
    bool half_resolution = false;

    std::optional<Region> region = {}; ///< what is wanted of the image; the rest of it is looked at all the same

    double tolerance = 1; ///< what depth may be off by, in half steps of its storage: more for a noisier sensor;
                          ///< surfaces stay open, and where no normals are given they are fitted likewise
    Image normals = {};   ///< 3 or 4 floats a pixel, (0, 0, 0) where there is none; default: from depth
    Space normals_space = Space::view; ///< axes that they are in
    bool bent_normal = false;          ///< wanted?
    bool confidence = false;           ///< wanted?
};

/// What the visibility of a plane that nothing rises above may differ from 1 by.
inline constexpr double ssao_plane_error = 0.002;

/// What `ssao` gives. All of the size of the depth image, or of the region.
struct Occlusion {
    Image visibility;  ///< one float: 1 open, 0 blocked
    Image bent_normal; ///< three floats, unit length, view space: mean of the open directions,
                       ///< weighted by the cosine
    Image confidence;  ///< one float: share of what was asked that lay inside the image on pixels with a known depth;
                       ///< with Border::clamp the repeated pixels count as known
};

/// Ambient occlusion from depth alone: the share of the hemisphere above each pixel's surface, weighted by the cosine,
/// in which a ray of length `radius` meets nothing that the image shows.
///
/// In: one stored value a pixel, and the length of the rays in scene units. Objects farther away than `radius` occlude
/// nothing. Out: visibility in 0..1; 1 for the background, NaN for what is no surface, as in every
/// other output, whose background is (0, 0, 0) and 1. A surface that nothing rises above has 1 to within
/// `ssao_plane_error`, under every camera and at tilts to 80°. A radius of less than a pixel gives 1.
/// Throws: std::invalid_argument for a radius that is not above 0 or not finite, for options out of range and for images
/// whose size does not fit; Error from the device.
/// Source: slices and their measure, Jimenez et al. 2016; sectors as bits, Therrien et al. 2023.
Occlusion ssao(const StoredDepth& stored, double radius, const SsaoOptions& options = {}, const Launch& launch = {});

/// The same into the caller's images: visibility, and the images that `options` asks for, with any row stride. They share
/// memory neither with an input nor with each other. An image that is not asked for is left alone.
void ssao(const StoredDepth& stored, const Occlusion& results, double radius, const SsaoOptions& options = {},
          const Launch& launch = {});

} // namespace fathom
