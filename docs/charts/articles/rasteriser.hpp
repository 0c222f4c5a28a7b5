#pragma once

#include <fathom/projection.hpp>

#include <Eigen/Core>

#include <array>
#include <vector>

/// A rasteriser of a few triangles in double precision, for the picture that Goldberg took of depth's derivatives.
namespace fathom::charts {

/// View space, OpenGL axes: x right, y up, −z ahead.
using Triangle = std::array<Eigen::Vector3d, 3>;

/// Who writes the depth, and what.
enum class DepthWriter {
    z_over_w,  ///< the projection: what a depth buffer holds
    linear,    ///< a fragment program: (z − near)/(far − near), z interpolated with perspective correction
    z_times_w, ///< a vertex program: the same times w, which the division takes away again
};

/// Triangles on a screen of `width` × `height` pixels, rows from the top.
struct Screen {
    Projection projection; ///< a perspective in the OpenGL axes, clip depth −1 to 1
    int width, height;
    double near_plane, far_plane;
};

/// A corner of a triangle as the rasteriser gets it.
struct ScreenCorner {
    double x, y;       ///< pixels
    double inverse_w;  ///< 1/w
    double clip_depth; ///< what the vertex program wrote, divided by w, mapped to 0..1
    double z;          ///< distance along the view axis
};

/// One triangle, ready to be asked anywhere on the screen, outside of itself too.
class ScreenTriangle {
public:
    ScreenTriangle(const Triangle& triangle, const Screen& screen, DepthWriter writer);

    bool covers(double x, double y) const;
    double depth(double x, double y) const;
    double inverse_w(double x, double y) const;
    const std::array<ScreenCorner, 3>& corners() const { return corners_; }

private:
    std::array<double, 3> weights(double x, double y) const;

    std::array<ScreenCorner, 3> corners_;
    double near_, far_;
    bool per_fragment_;
};

/// What stands in the picture at every pixel; `triangle` is −1 where nothing is.
struct DepthPicture {
    int width, height;
    std::vector<int> triangle;
    std::vector<double> depth, dx, dy; ///< dx, dy: to the next pixel of the same triangle, as graphics cards take them
};

DepthPicture rasterise(const std::vector<Triangle>& triangles, const Screen& screen, DepthWriter writer);

/// The picture's scene: one plane, seen at a slant, cut into triangles of uneven sizes.
Screen slanted_screen(int width, int height);
std::vector<Triangle> slanted_plane(const Screen& screen);

/// 1/z of that plane on the screen: a x + b y + c, x and y from 0 to 1.
inline constexpr std::array<double, 3> slanted_inverse_depth{-0.1, 0.3, 0.2};

} // namespace fathom::charts
