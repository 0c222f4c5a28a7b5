#pragma once

#include <fathom/camera.hpp>

namespace fathom {

inline bool is_float(Storage storage) {
    return storage == Storage::float32 || storage == Storage::float16;
}

/// Does decoding need the lengths of the camera's rays?
bool is_along_ray(const DepthForm& form);

/// `view_depth` for many points, of what was derived once from the camera.
long double view_depth(const DepthForm& form, const Rays& rays, double x, double y, double stored);

} // namespace fathom
