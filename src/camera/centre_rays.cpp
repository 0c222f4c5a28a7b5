// Rays from the camera centre, along which planes are affine on the screen.
//   n·(O + w D(x, y)) = c  ⇒  1/w = n·D(x, y) / (c − n·O)                     rays that meet in the camera centre O
//   n·(O(x, y) + w D) = c  ⇒  w = (c − n·O(x, y)) / n·D                       orthographic rays
// The ray O + w D is that of Lenaerts, part 2; the planes follow. Operations that compare depths take 1/w under a
// perspective and w under an orthographic projection.

#include "camera/centre_rays.hpp"

namespace fathom {

CentreRays centre_rays(const Rays& rays) {
    CentreRays result{.perspective = !rays.w_is_depth || !rays.direction.leftCols<2>().isZero(),
                      .origin = rays.origin,
                      .direction = rays.direction,
                      .depth = rays.depth,
                      .centre_depth = rays.centre_depth};
    if (!result.perspective)
        result.centre_depth = 0; // depth is counted from where the rays cross z = 0
    if (result.perspective && rays.w_is_depth) {
        result.origin.col(2) += rays.centre_depth * rays.direction.col(2);
        result.origin.leftCols<2>().setZero();
    }
    return result;
}

} // namespace fathom
