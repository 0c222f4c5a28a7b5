#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace fathom {

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

PlaneQuantity quantity_of(Shape shape, double parameter, const PlaneSample& sample);

/// How far a quantity of each sample is from being affine in the pixel over a patch of up to 64 samples: the root of the mean
/// square, in stored units.
double misfit(std::span<const PlaneSample> patch, std::span<const PlaneQuantity> quantities);
double misfit(std::span<const PlaneSample> patch, Shape shape, double parameter);

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

/// `values` has rows without gaps; NaN is left out. Storing rounds a value v to ± (step + relative_step |v|) / 2.
PlaneFits fit_planes(const std::vector<float>& values, int width, int height, double step, double relative_step);

} // namespace fathom
