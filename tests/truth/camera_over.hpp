#pragma once

#include <fathom/camera.hpp>

namespace fathom {

/// A camera in the window encoding that a projection gives over an image, its rows from the top.
inline Camera camera_over(const Projection& projection, int width, int height) {
    Camera camera;
    camera.projection = projection;
    camera.width = width;
    camera.height = height;
    return camera;
}

} // namespace fathom
