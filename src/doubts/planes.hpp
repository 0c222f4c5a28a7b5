#pragma once

#include <fathom/camera.hpp>

#include <Eigen/Core>

#include <array>
#include <functional>
#include <optional>
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

/// A window with its stored values, and the depths that they are decoded to: not finite where there is none.
struct Sampled {
    Window window;
    std::array<float, Window::size> values{}, z{};
};

/// The unit ray through a position in the image, its third part ahead. None where nothing is seen.
using View = std::function<std::optional<Eigen::Vector3d>(double x, double y)>;

/// Of a camera, through its lens or not.
View view_of(const Camera& camera);

/// Of a pinhole whose axis meets the middle of the image: half of it is so many times as wide as it is far away.
View pinhole_view(int width, int height, double tangent);

View panorama_view(int width, int height);

/// One over the length that a stored value means, up to a factor, and how it changes with the value.
struct Inverse {
    double value, change;
};

/// What stored values could be. Over a plane 1/z is affine in the pixel of a pinhole, and 1/distance linear in the unit ray u. So their
/// quotient by u's part along any one direction is affine in the place where u meets the plane across it.
struct Reading {
    std::function<Inverse(double v)> inverse = {};
    Along along = Along::axis;
    double further = 0; ///< what is added to the distance along the axis that follows
    bool is_parallel =
        false;      ///< of an orthographic camera, whose lengths are affine in the pixel: `inverse` is the length
    View view = {}; ///< empty: that of all others
};

/// What a camera says of values, which went through a curve before if there is a `gamma`.
Reading reading_of(const Camera& camera, Storage storage, std::optional<double> gamma = {});

/// Families of readings, each with one parameter p that can be searched. Values v are parts of the largest.
enum class Shape {
    affine,          ///< 1/length is v: depth-buffer values, inverse depth, and lengths of an orthographic camera
    reciprocal,      ///< 1/v: distance along the axis
    offset,          ///< 1/(v + p): the same from a near plane on
    reversed_offset, ///< 1/(1 + p - v): the same, counted backwards
    ray,             ///< 1/v along the ray; p is the tangent of half the field of view across
    inverse_ray,     ///< v along the ray; p as for `ray`
    logarithmic,     ///< 1/(exp(p v) - 1)
    exponential,     ///< exp(-p v)
    display,         ///< 1/(w + p), w what v was before the curve of sRGB
    panorama,        ///< 1/v along the ray of a picture of all directions
};

/// `largest`: the value that counts as 1.
Reading reading_of(Shape shape, double parameter, double largest, int width, int height);

/// Values are rounded to a step, and to a part of themselves.
struct Rounding {
    double step = 0, relative_step = 0;
};

/// A window's samples that have a depth, under the rays that most readings share.
struct Patch {
    /// Where a ray meets the plane across the window's middle ray, and by what to multiply 1/length along each of `Along`.
    struct Place {
        double right, down;
        std::array<double, 3> factors;
    };

    const Window* window = nullptr;
    std::vector<int> chosen = {};
    std::vector<double> values = {};
    std::vector<Place> places = {};
    double noise = 0;   ///< what a cubic polynomial leaves of the values, the root of the mean square
    double rounded = 0; ///< what their rounding does
    double low = 0, high = 0;

    double range() const { return high - low; }
};

/// None where fewer than 80 % of the samples have a depth or a ray, or where an edge lies: no surface rises so steeply.
std::optional<Patch> patch_of(const Sampled& sampled, const View& view, const Rounding& rounding);

/// How far a patch is from a plane under a reading: the root of the mean square, in stored units. None where it has no rays.
std::optional<double> misfit(const Patch& patch, const Reading& reading);

/// What a cubic polynomial leaves of the values.
double cubic_misfit(const Patch& patch);

/// Is there noise from sample to sample, and no edge, which a cubic polynomial does not follow?
bool is_smooth(const Sampled& sampled, const Patch& patch);

enum class Verdict { none, flat, bent };

/// What tells flat from bent. A patch is flat under the best reading if that leaves `flat` times the noise, and under others that leave
/// `fits` times as much as it; bent where they leave `fails` times as much. `apart` is how much the worst must leave.
struct Bars {
    double flat, fits, fails, apart;
};
inline constexpr Bars of_known{1.25, 1.3, 2, 2}; ///< readings
inline constexpr Bars of_searched{1.5, 2, 4, 8}; ///< those with parameters that are right but for a little

/// How a patch looks under several readings that leave these misfits, of which none counts as less than `least`. Nothing where it is
/// flat under none, as an edge is, or under all.
std::vector<Verdict> judge(std::span<const double> misfits, double noise, double least, const Bars& bars);

/// Where a cost is least: the best of a geometric grid of `steps`, made finer by golden sections.
double least_at(const std::function<double(double)>& cost, double least, double greatest, int steps);

/// The parameter under which the third of the patches that fits best fits best.
/// `make`: the reading of a parameter from `least` to `greatest`, of which a geometric grid of `steps` is tried first.
double best_parameter(std::span<const Patch> patches, const std::function<Reading(double)>& make, double least,
                      double greatest, int steps);

/// Some of them, evenly.
std::vector<Patch> some_of(const std::vector<Patch>& patches, std::size_t most);

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
    std::vector<ShapeFit> shapes;
};

/// `values` has rows without gaps; NaN is left out.
PlaneFits fit_planes(const std::vector<float>& values, int width, int height, Rounding rounding);

} // namespace fathom
