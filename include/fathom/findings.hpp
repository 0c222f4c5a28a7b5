#pragma once

#include <fathom/camera.hpp>
#include <fathom/precision.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

/// What a depth image holds and what a camera makes of it, on the host: what `fathom inspect` prints. Needs no device.
namespace fathom {
#pragma GCC visibility push(default)

/// Stored depth in host memory.
struct HostDepth {
    const void* data = nullptr;
    int width = 0;             ///< pixels
    int height = 0;            ///< pixels
    std::size_t row_bytes = 0; ///< from one row to the next
    Storage storage = Storage::float32;
};

/// Which percentiles `StoredStatistics` holds.
inline constexpr std::array stored_percents{1, 5, 25, 50, 75, 95, 99};

/// Statistics of the stored values as they lie in memory: integer codes or floats.
struct StoredStatistics {
    double min = NAN; ///< of the finite values, as the maximum and the percentiles; NaN when there is none
    double max = NAN;
    std::array<double, stored_percents.size()> percentiles{}; ///< nearest rank: always a value of the image
    std::size_t pixels = 0, nan = 0, inf = 0, minus_inf = 0;
    std::size_t at_zero = 0;    ///< pixels that hold 0, which may be the background
    std::size_t at_largest = 0; ///< pixels that hold the largest code (1 of floats), which may be the background
};

/// Counts the stored values and ranks the finite ones.
StoredStatistics stored_statistics(const HostDepth& stored);

/// A pixel that shows a surface, and how finely depth is stored there.
struct SurfacePoint {
    const char* name;                           ///< nearest, middle (the median), farthest
    double z;                                   ///< distance along the view axis, scene units
    double x, y;                                ///< the pixel's centre
    std::optional<double> spacing, error_bound; ///< scene units; none for a buffer whose steps are not known
};

/// A depth of the camera's range and how finely it is stored, at the middle of the image.
struct RangePoint {
    const char* name;                           ///< near, middle (the stored value half way), far
    double stored;                              ///< a float, or a code of the buffer of `CameraFindings::bits`
    double z;                                   ///< scene units; may be infinite
    std::optional<double> spacing, error_bound; ///< scene units; none for a buffer whose steps are not known
};

/// The greatest depth that can be stored at a place of the image; see `attainable_depth`.
struct AttainablePoint {
    const char* place; ///< a corner ("top left") or "centre"
    double z;          ///< scene units; may be infinite
};

/// What a lens makes of an image's pixels.
struct LensFindings {
    std::size_t no_ray = 0;       ///< pixels that no ray meets: beyond a fold, or outside a fisheye's circle
    std::size_t steep = 0;        ///< beyond 89 degrees from the axis, if depth counts along it: they have none
    std::optional<LensFold> fold; ///< where the lens folds
};

/// What a camera makes of stored values.
struct CameraFindings {
    Camera camera;
    DepthForm form;
    std::size_t background = 0;                ///< pixels that hold the background
    std::size_t missing = 0;                   ///< pixels whose value says that nothing was measured
    std::optional<DepthBits> bits;             ///< of the buffer whose precision is reported; none for half floats
    std::vector<RangePoint> range;             ///< near, middle, far; none where the stored values have no end
    std::optional<std::size_t> invalid;        ///< pixels whose value is no depth; none when the image was not decoded
    std::vector<SurfacePoint> surfaces;        ///< nearest, middle, farthest; none when no pixel shows a surface
    std::array<AttainablePoint, 5> attainable; ///< the corners and the centre
    std::optional<LensFindings> lens = {};
};

/// Looks at stored values through a camera of the image's size. `depth` is what `linearize` makes of them with
/// `Background::inf`, rows without gaps, and through a lens with `Along::ray`; without it no surface is described. Depths through a
/// lens are distances.
/// Throws: std::invalid_argument for a camera that `depth_form` refuses, and for depth of another size.
CameraFindings camera_findings(const Camera& camera, const HostDepth& stored, std::span<const float> depth = {});

#pragma GCC visibility pop
} // namespace fathom
