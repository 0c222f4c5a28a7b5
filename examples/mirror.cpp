// The camera of a mirror: its near plane is the mirror, so everything before the mirror is clipped away.

#include <fathom/fathom.hpp>

#include <iostream>

fathom::Camera mirror() {
    const auto wide = fathom::perspective(1.0, 4.0 / 3, {0.1, 500});
    fathom::Camera camera;
    camera.projection = fathom::with_oblique_near_plane(wide, {0.3, 0.2, -0.9, -2});
    camera.width = 640;
    camera.height = 480;
    return camera; // fathom::depth_form(camera).form is reciprocal_affine
}

int main() {
    std::cout << fathom::depth_form(mirror()).reason << '\n';
}
