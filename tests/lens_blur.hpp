#pragma once

// What a lens makes of flat layers that face it, in double, by quadrature over the lens. Shares nothing with the library.

#include <functional>
#include <vector>

namespace lens_blur {

/// A hole in the unit disc: a circle, an ellipse, or a regular polygon with a corner on top, turned counter-clockwise.
struct ApertureShape {
    int corners = 0; ///< 0: a circle
    double turned_degrees = 0;
    double ratio = 1; ///< of an ellipse, height over width before it is turned; the longer axis is the disc's

    bool open(double x, double y) const; ///< y up
};

/// How much of a hole lies at each of many positions from -1 to 1 along an axis: to the right, or down an image.
/// Sums to 1.
std::vector<double> shares(const ApertureShape& aperture_shape, bool down, int positions = 4096);

/// A layer at one depth that changes along one axis only. Positions are pixels of the sharp image.
struct Layer {
    double circle;                    ///< diameter in pixels, positive behind the focus
    std::function<bool(double)> here; ///< does the layer block light there?
    std::function<double(double)> color;
};

/// The light that reaches a position: for each part of the lens that of the first layer that its rays meet, nearest first.
/// The last layer must be everywhere.
double light(const std::vector<Layer>& nearest_first, const std::vector<double>& shares, double position);

/// A layer in the image's plane, x to the right and y down, whose circle changes evenly from row to row as that of a floor.
struct Slope {
    double circle, each_row; ///< at y = 0, and what it grows by
    std::function<bool(double x, double y)> here;
    double color;
};

/// The same through all of the lens, across and down; each layer is before the next wherever both are.
double light(const std::vector<Slope>& nearest_first, const ApertureShape& aperture_shape, double x, double y,
             int positions = 128);

/// Share of a blurred half-plane's light at distance d into it, of radius r: t = d/r, 1/2 + (t root(1 - t^2) + asin t)/pi.
double half_plane(double t);

} // namespace lens_blur
