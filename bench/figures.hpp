#pragma once

#include "measure.hpp"
#include "table.hpp"

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace fathom::bench {

/// How far results are from the truth, over sample points.
struct Deviation {
    std::string unit;
    double mean = 0; ///< signed, where the unit has a sign
    double rms = 0, p99 = 0, worst = 0;
    double common = 0; ///< rms of all but the worst 2 %
    std::size_t points = 0;
};

/// Root of the mean of all but the largest 2 % of the squares.
double common_rms(std::vector<double> squares);

/// Of single errors, signed or not.
Deviation summary(std::string unit, const std::vector<double>& errors);

/// What is known about one method at one place; a row of every table that fathom_bench writes.
struct Figures {
    std::string operation; ///< as the library names it; copy: a floor
    std::string method;    ///< preset, form or formula
    std::string kind;      ///< library, baseline, opencv, python, blender or floor
    std::string storage;
    std::string scene; ///< frames: random depths
    int width = 0, height = 0;
    double radius_px = 0; ///< ssao: at the median depth; dof and dof_masks: the max CoC's diameter. 0: none
    std::vector<double> seconds = {};
    std::string floor = {};
    double floor_seconds = 0; ///< median
    std::optional<Deviation> error = {};
    std::optional<Deviation> scene_error = {}; ///< ssao: against the scene itself, at the method's own thickness
    std::vector<double> squares = {};          ///< of the error at each sample point; not in the table
    double bytes = 0;                          ///< of the device's memory; 0: not counted
};

/// One line for people.
void print_row(const Figures& row);

/// The columns of such a table, which do not change:
///   device, driver, commit                as Table writes them
///   operation, method, kind, storage, scene, width, height, radius_px     as above
///   clock                                 wall, or processor: time of all threads together
///   runs, ms, ms_q25, ms_q75              how often it was timed; the median, and the quartiles
///   floor, floor_ms, time_to_floor        the copy that moves the same bytes, its median, and the ratio of the medians
///   unit, mean, rms, p99, worst, points   the error against the truth over sample points:
///                                           ulp        of the depth's float (linearize); of the larger of circle and k
///                                           2^-24      of the distance (unproject)
///                                           degrees    between normals, not signed; 90 for none
///                                           visibility got less true
///                                           colour     of 1, got less true
///   scene_mean, scene_rms, scene_p99, scene_worst    ssao: the same against rays into the scene itself
///   bytes                                 images in and out, and scratch
///   common                                rms of all but the worst 2 % of the points
/// Empty: not measured.
Table table_of(const Device& device, const std::vector<Figures>& rows, Clock clock);

/// Each preset of ssao and dof beside every other preset, and every other method that may be more exact, at each place: what the other's `common` error is divided by the
/// preset's, and between what 95 % of paired bootstraps of the sample points have it.
///   device, driver, commit                as Table writes them
///   operation, method, storage, scene, width, height, radius_px    as above; the method is the preset
///   other, ratio, least, most
Table pairs_of(const Device& device, const std::vector<Figures>& rows);

} // namespace fathom::bench
