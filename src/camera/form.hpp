#pragma once

#include <fathom/camera.hpp>

namespace fathom {

/// Does the form need the rays of the camera?
bool is_along_ray(const DepthForm& form);

/// `view_depth` for many points, of what was derived once from the camera.
long double view_depth(const DepthForm& form, const Rays& rays, double x, double y, double stored);

} // namespace fathom
