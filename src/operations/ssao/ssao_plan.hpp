#pragma once

#include "camera/rays.hpp"
#include "operations/bands.hpp"
#include "operations/ssao/ssao_call.hpp"

#include <fathom/image.hpp>
#include <fathom/ssao.hpp>

#include <vector>

namespace fathom {

/// The rows above and below row `y` of the camera's image that a sphere around a surface may cover: infinite where it has no
/// bound on the screen. `nearest` is the surface's inverse depth. Pure: no device.
double rows_of_sphere(const CentreRays& rays, double radius, double y, double nearest);

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
