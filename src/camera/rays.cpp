// Rays from the camera centre, along which planes are affine on the screen.
//   n·(O + w D(x, y)) = c  ⇒  1/w = n·D(x, y) / (c − n·O)                     rays that meet in the camera centre O
//   n·(O(x, y) + w D) = c  ⇒  w = (c − n·O(x, y)) / n·D                       orthographic rays
// The ray O + w D is that of Lenaerts, part 2; the planes follow. Operations that compare depths take 1/w under a
// perspective and w under an orthographic projection.
//   position = view⁻¹ (O + w D)                                                in the world

#include "camera/rays.hpp"

#include "camera/matrix.hpp"
#include "require.hpp"

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

Rays axes_of_view() {
    Rays axes;
    axes.direction.setIdentity();
    return axes;
}

Rays rays_in_world(const Rays& rays, const Eigen::Matrix4d& view, const Eigen::Vector3d& origin) {
    require(view.allFinite() && view.row(3) == Eigen::RowVector4d(0, 0, 0, 1),
            "the view matrix must be finite with a fourth row of 0 0 0 1");
    require(origin.allFinite(), "origin = (", origin.transpose(), ") must be finite");
    const auto inverse = checked_inverse(view.cast<long double>(), "the view matrix");
    Rays world = rays;
    world.direction = inverse.topLeftCorner<3, 3>() * rays.direction;
    world.origin = inverse.topLeftCorner<3, 3>() * rays.origin;
    world.origin.col(2) += inverse.topRightCorner<3, 1>() - origin.cast<long double>();
    return world;
}

} // namespace fathom
