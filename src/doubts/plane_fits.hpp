#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace fathom {

/// A window of an image, and where its 8 x 8 samples lie, row by row.
struct Window {
    static constexpr int across = 8, size = across * across;

    int left = 0, top = 0, width = 0, height = 0;

    int x(int i) const { return left + (width - 1) * (i % across) / (across - 1); }
    int y(int i) const { return top + (height - 1) * (i / across) / (across - 1); }

    /// From the middle, in half the window's size.
    double u(int i) const { return 2.0 * (x(i) - left) / (width - 1) - 1; }
    double t(int i) const { return 2.0 * (y(i) - top) / (height - 1) - 1; }
};

/// Windows of one size over an image, at most so many in a row of them and in a column.
std::vector<Window> windows_of(int image_width, int image_height, int width, int height, int most);

/// A window's samples must mostly be valid.
inline constexpr double least_samples = 0.8 * Window::size;

/// What of the stored value v is affine in the pixel over a plane. s is the ray's length for a depth of one, which
/// grows away from the middle of the image, p the shape's parameter. Values count in units of the largest.
enum class Shape {
    affine,          ///< v: depth-buffer values, inverse depth, orthographic depth
    reciprocal,      ///< 1/v: distance along the axis
    offset,          ///< 1/(v + p): the same from a near plane on
    reversed_offset, ///< 1/(1 + p - v): the same, counted backwards
    ray,             ///< s/v: distance along the ray; p is the tangent of half the field of view across
    inverse_ray,     ///< s v: inverse distance along the ray; p as for `ray`
    logarithmic,     ///< 1/(exp(p v) - 1)
    exponential,     ///< exp(-p v)
    panorama, ///< 1/(v e u): distance along the unit rays u of a picture of all directions, e that of the patch's middle
};

/// A stored value of a patch of the image.
struct PlaneSample {
    double x = 0, y = 0; ///< how far its ray goes across and down for a depth of one: p times these
    double u = 0, t = 0; ///< from the middle of the patch, in half its size
    double v = 0;
};

/// A function of a stored value that is affine in the pixel over planes, and how much the value changes with it.
struct PlaneQuantity {
    double value = 0, change = 1;
};

/// Of any shape but `panorama`, over whose planes it is affine in another place than the pixel.
PlaneQuantity quantity_of(Shape shape, double parameter, const PlaneSample& sample);

/// How far a quantity of each sample is from being affine in the pixel over a patch of up to 64 samples: the root of the mean
/// square, in stored units.
double misfit(std::span<const PlaneSample> patch, std::span<const PlaneQuantity> quantities);
double misfit(std::span<const PlaneSample> patch, Shape shape, double parameter);

/// Values are rounded to a step, and to a part of themselves.
struct Rounding {
    double step = 0, relative_step = 0;

    /// The root of the mean square of its errors in a patch.
    double in(std::span<const PlaneSample> patch) const;
};

/// What a cubic polynomial leaves of the values of a patch, the root of the mean square: noise, where there is no edge.
double cubic_misfit(std::span<const PlaneSample> patch);

enum class Verdict { none, flat, bent };

/// What tells flat from bent. A patch is flat under the best description if that leaves `flat` times the noise, and under others that
/// leave `fits` times as much as it; bent where they leave `fails` times as much. `apart` is how much the worst must leave.
struct Bars {
    double flat, fits, fails, apart;
};
inline constexpr Bars of_known{1.25, 1.3, 2, 2}; ///< descriptions
inline constexpr Bars of_searched{1.5, 2, 4, 8}; ///< those with parameters that are right but for a little

/// How a patch looks under several descriptions that leave these misfits, of which none counts as less than `least`. Nothing where it
/// is flat under none, as an edge is, or under all.
std::vector<Verdict> judge(std::span<const double> misfits, double noise, double least, const Bars& bars);

/// How one shape fits the flat patches of an image.
struct ShapeFit {
    Shape shape = Shape::affine;
    double parameter = 0;
    std::size_t fits = 0;  ///< patches whose residual is noise
    std::size_t fails = 0; ///< patches whose residual is clearly more than noise
    bool at_limit = false; ///< the parameter is where the shape becomes a simpler one: `affine` or `reciprocal`
};

/// Flat patches that tell the shapes apart, and what each shape makes of them.
struct PlaneFits {
    std::size_t smooth = 0;  ///< patches without an edge, flat or curved
    std::size_t patches = 0; ///< of these, flat under one shape and not under all
    std::size_t places = 0;  ///< of a grid of 8 x 6 over the image, those that have such a patch
    double noise = 0;        ///< of the values in them, stored units: the median of the root mean squares
    std::vector<ShapeFit> shapes;
};

/// `values` has rows without gaps; NaN is left out.
PlaneFits fit_planes(const std::vector<float>& values, int width, int height, Rounding rounding);

} // namespace fathom
