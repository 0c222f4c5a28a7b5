#pragma once

#include "views.hpp"

#include <fathom/lens.hpp>

#include <Eigen/Core>

#include <vector>

namespace fathom::bench {

/// A view as a pinhole sees it: red, green and blue of each pixel, the mean over a few places in it.
std::vector<float> picture_of(const View& view);

/// Red, green and blue of a pixel through a lens of this circle of confusion, by quadrature over the lens and the pixel:
/// each ray runs from a point of the lens through the point in focus into the scene itself, so that what a pinhole's picture
/// does not hold is in it. Beyond the far plane there is nothing, as in the picture.
class LensTruth {
public:
    LensTruth(const View& view, const CircleOfConfusion& circle);

    Eigen::Vector3d at(int x, int y) const;

private:
    Eigen::Vector3d along(double x, double y, const Eigen::Vector2d& on_lens) const;

    const View& view_;
    scene::Caster caster_;
    Eigen::Matrix4d to_world_;
    Eigen::Matrix<double, 2, 4> inside_; ///< times a position: not below 0 behind the near plane and before the far one
    double focus_, lens_radius_;
    bool perspective_;
};

} // namespace fathom::bench
