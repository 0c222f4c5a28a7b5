#pragma once

#include "lens/laws.hpp"

namespace fathom::lens {

/// The ray of a map at a position from the corner of its first pixel: of the four pixels around it, where all of them have one. In a
/// pixel's centre it is the pixel's own.
std::optional<RayJets> mapped_ray(const RayMap& map, const Jet& x, const Jet& y);

/// Newton's step in pixels from where a lens sees `ray` to where it sees the unit vector `direction`, by least squares.
Eigen::Vector2d step_towards(const Eigen::Vector3d& direction, const RayJets& ray);

/// Where a map sees a unit vector: beside the pixel whose ray is the nearest one, at most a pixel away from its centre.
std::optional<Eigen::Vector2d> mapped_pixel(const RayMap& map, const Eigen::Vector3d& direction);

} // namespace fathom::lens
