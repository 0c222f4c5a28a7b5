#pragma once

#include "camera_over.hpp"

#include <fathom/camera.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <exception>
#include <string>

/// The way to the image, written from the definitions: clip = P · point, viewport, depth range. Shares no code with the
/// library, which goes the other way.
namespace fathom::seen {

using Real = long double;
using Point = Eigen::Matrix<Real, 3, 1>;

/// Pixel position and stored value, in the window encoding, of a point.
struct Place {
    Real x, y, stored;
};

inline Camera camera_of(const Projection& projection, int width = 64, int height = 32) {
    return camera_over(projection, width, height);
}

inline Place place_of(const Camera& camera, const Point& point) {
    const Projection& p = camera.projection;
    const Eigen::Matrix<Real, 4, 1> clip = p.matrix * point.homogeneous();
    const Real up = clip.y() / clip.w() * (p.convention.clip_y == ClipY::up ? 1 : -1);
    const Real from_top = (1 - up) / 2, low = p.convention.clip_z == ClipZ::negative_one_to_one ? -1 : 0;
    const Real share = (clip.z() / clip.w() - low) / (1 - low);
    return {(clip.x() / clip.w() + 1) / 2 * camera.width,
            (camera.rows == Rows::top_down ? from_top : 1 - from_top) * camera.height,
            camera.depth_range[0] + share * (static_cast<Real>(camera.depth_range[1]) - camera.depth_range[0])};
}

/// Distance along the view axis of a point in the projection's own axes.
inline Real depth_of(const Camera& camera, const Point& point) {
    return camera.projection.convention.view_axes == ViewAxes::opengl ? -point.z() : point.z();
}

/// From the OpenGL axes to others, and back.
inline Point turned(ViewAxes axes, const Point& point) {
    return {point.x(), axes == ViewAxes::opencv ? -point.y() : point.y(),
            axes == ViewAxes::opengl ? point.z() : -point.z()};
}

/// κ = Σ|terms| / |sum| of a form's sums: how much a relative error of a stored value grows in z.
inline Real condition(const DepthForm& form, Real v, Real x, Real y) {
    const auto of = [&](const Affine& row) {
        const Real terms[] = {row[0] * v, row[1] * x, row[2] * y, row[3]};
        Real sum = 0, sizes = 0;
        for (const Real term : terms) {
            sum += term;
            sizes += std::abs(term);
        }
        return sizes / std::abs(sum);
    };
    return std::max(of(form.numerator), of(form.denominator));
}

/// What a refusal says; empty when nothing was refused.
template <typename Action>
std::string refusal(Action action) {
    try {
        action();
    } catch (const std::exception& error) {
        return error.what();
    }
    return {};
}

} // namespace fathom::seen
