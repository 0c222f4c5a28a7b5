#pragma once

#include "camera/rays.hpp"
#include "operations/bands.hpp"
#include "operations/ssao/ssao_call.hpp"

#include <fathom/image.hpp>
#include <fathom/ssao.hpp>

#include <vector>

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

/// How far rows [begin, end) of the depth's image reach. Waits for the device where the camera is a perspective one.
std::vector<int> ssao_reaches(const StoredDepth& stored, const CentreRays& rays, int begin, int end,
                              const SsaoReach& reach, std::size_t band_bytes);

/// That of the nearest surface of all, at least 0: background alone. Waits for the device.
double nearest_inverse_depth(const StoredDepth& stored, std::size_t band_bytes);

/// How far any pixel of the camera's image reaches along its rows and columns, if no surface is nearer than inverse depth
/// `nearest`; infinite where nothing bounds it. Pure: no device.
double ssao_columns(const Camera& camera, const CentreRays& rays, const SsaoReach& reach, double nearest);
double ssao_rows(const Camera& camera, const CentreRays& rays, const SsaoReach& reach, double nearest);

/// Bytes of the largest image of planes that any pass needs for so many rows of the depth.
std::size_t plane_bytes(const Tile& tile, const SsaoOptions& options, int rows);

/// Rows of the results in bands, and what each of them takes.
struct SsaoPlan {
    std::vector<Band> bands;
    PassBytes bytes;
};

/// The whole image, or bands of it that keep to the device's budget.
SsaoPlan ssao_plan(const StoredDepth& stored, double radius, const SsaoOptions& options);

} // namespace fathom
