#pragma once

#include "options.hpp"

#include <fathom/io.hpp>
#include <fathom/precision.hpp>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace fathom::cli {

/// Which stored values are shown between the smallest and the largest.
inline constexpr std::array percents{1, 5, 25, 50, 75, 95, 99};

/// What the stored values are, as they lie in the file: integer codes or floats.
struct Statistics {
    double min = NAN; ///< of the finite values, as the maximum and the percentiles
    double max = NAN;
    std::array<double, percents.size()> percentiles{}; ///< nearest rank: always a value of the image
    std::size_t pixels = 0, nan = 0, inf = 0, minus_inf = 0;
    std::size_t at_zero = 0, at_largest = 0; ///< pixels at 0 and at the largest code: one of them may be background
};

/// A surface of the image and how finely depth is stored there.
struct Surface {
    std::string name;
    double z;                                   ///< scene units
    double x, y;                                ///< the pixel's centre
    std::optional<double> spacing, error_bound; ///< scene units; none for a buffer whose steps are not known
};

/// A depth of the camera's range and how finely it is stored, at the middle of the image.
struct RangePoint {
    const char* name;
    double stored;                              ///< a float, or a code of the buffer that the precision is told for
    double z;                                   ///< scene units; may be infinite
    std::optional<double> spacing, error_bound; ///< scene units; none for a buffer whose steps are not known
};

/// What a camera makes of the stored values.
struct CameraFindings {
    Camera camera;
    DepthForm form;
    std::size_t background = 0;                             ///< pixels
    std::optional<DepthBits> bits;                          ///< of the buffer that the precision is told for
    std::vector<RangePoint> range;                          ///< near, middle, far; none where the range has no end
    std::vector<Surface> surfaces;                          ///< the nearest, the middle and the farthest
    std::string no_surfaces;                                ///< why there are none
    std::optional<std::size_t> invalid;                     ///< pixels whose value is no depth, once decoded
    std::vector<std::pair<std::string, double>> attainable; ///< place in the image, greatest depth there
};

/// What `fathom inspect` tells of a depth image.
struct Findings {
    DepthFile depth;
    std::vector<Channel> channels;
    Statistics statistics;
    std::optional<CameraFindings> camera;
};

/// Reads a depth image and looks at it, through a camera where `camera` names a file. Decoding needs a device; without
/// one, and if none was asked for, there are no surfaces to tell of.
Findings look_at(const std::string& file, const std::string& camera, const std::string& channel,
                 const DeviceOption& device);

} // namespace fathom::cli
