#pragma once

#include <fathom/device.hpp>

#include <limits>
#include <string>
#include <vector>

/// Where methods fail: each regime is swept through one parameter until a method breaks. bench/where_it_fails.cpp writes what
/// is found, tests/test_regimes.cpp holds both sides of every boundary.
namespace fathom::regimes {

inline constexpr double none = std::numeric_limits<double>::quiet_NaN();

/// One value of the parameter: the error that was measured against the truth, and what it may be by the arithmetic.
struct Point {
    double parameter, error;
    double bound = none;
};

/// A method over the parameter.
struct Curve {
    std::string name;
    std::vector<Point> points = {};
};

/// Curves of one quantity, drawn together.
struct Panel {
    std::string quantity; ///< with its unit
    std::vector<Curve> curves = {};

    /// The curve of that name, made where there is none.
    Curve& curve(const std::string& name);
};

/// Where a curve leaves a limit: at parameters up to `holds` the error is at most `limit`, from `breaks` on it is more.
/// Where `breaks` is the lesser of the two the method fails towards 0; where it is `none` the limit holds wherever the
/// sweep went.
struct Boundary {
    std::string quantity, curve;
    double limit, holds, breaks;
    std::string why;                            ///< where the limit comes from
    double holds_from = none, breaks_to = none; ///< other ends of the two, where they are not those of the sweep
};

struct Regime {
    std::string name;      ///< of the chart's file
    std::string parameter; ///< with its unit
    std::vector<Panel> panels = {};
    std::vector<Boundary> boundaries = {};

    Panel& panel(const std::string& quantity);
};

/// A regime and what sweeps it.
struct Sweep {
    const char* name;
    Regime (*run)(const Device& device);
};

const std::vector<Sweep>& sweeps();

Regime far_over_near(const Device& device);
Regime oblique_angle(const Device& device);
Regime oblique_distance(const Device& device);
Regime bits_of_depth(const Device& device);
Regime noise_on_depth(const Device& device);
Regime grazing_angle(const Device& device);
Regime radius_of_occlusion(const Device& device);
Regime ring_of_a_radius(const Device& device);
Regime border_of_the_image(const Device& device);
Regime thin_occluders(const Device& device);
Regime focus_distance(const Device& device);
Regime aperture(const Device& device);
Regime highlights(const Device& device);
Regime filter_width(const Device& device);
Regime depth_offset(const Device& device);
Regime motion(const Device& device);
Regime w_range(const Device& device);
Regime field_of_view(const Device& device);
Regime distortion(const Device& device);
Regime latitude_of_a_panorama(const Device& device);
Regime radius_over_distance(const Device& device);

} // namespace fathom::regimes
