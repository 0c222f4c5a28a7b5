#pragma once

#include "camera/centre_rays.hpp"
#include "operations/bands.hpp"

#include <fathom/image.hpp>

#include <span>

namespace fathom {

/// How far beside a pixel lies what decides on its result.
struct SsaoReach {
    double radius;      ///< scene units
    int samples;        ///< on a side of a slice, the fewest of any pass
    bool half;          ///< are some results interpolated?
    double silhouettes; ///< length that they are looked for in, scene units; 0: they are not
};

/// The rows above and below row `y` of the camera's image that a sphere around a surface may cover: infinite where it has no
/// bound on the screen. `nearest` is the surface's inverse depth. Pure: no device.
double rows_of_sphere(const CentreRays& rays, double radius, double y, double nearest);

/// What rows [begin, end) of the depth's image reach. Waits for the device where the camera is a perspective one.
ReachingRows ssao_rows(const StoredDepth& stored, const CentreRays& rays, int begin, int end, const SsaoReach& reach,
                       std::size_t band_bytes);

} // namespace fathom
