#pragma once

#include "figures.hpp"
#include "methods.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace fathom::bench {

/// How long to measure.
struct Effort {
    int rounds = 31;
    double seconds = 2; ///< no method takes more in all, but three runs
    std::string only = {};
    std::function<void(const Figures&)> report = {}; ///< told of every row as soon as it is there
};

inline constexpr double longest_run = 2.5; ///< seconds

inline constexpr double largest_accurate_px = 128;

using Size = std::pair<int, int>;

/// What errors are measured at, and times too.
inline constexpr Size error_size{960, 540};

/// A program that compares others with fathom, and what it is told.
struct Comparison {
    const char *name, *help;
    const char* of_program = ""; ///< the option that names the program to compare with, if there is one
    std::string program = {};
    Effort effort = {.report = print_row};
    int width = 1920, height = 1080;
    std::string csv = {};

    int error_width() const { return std::min(width, error_size.first); }
    int error_height() const { return error_width() * height / width; }

    /// Its `main`: takes --size, --rounds, --seconds, --csv and `of_program`, and writes the rows that `measure` makes on the
    /// CPU, if there are any. An unknown argument brings `help`.
    int run(int argc, char** argv,
            const std::function<std::vector<Figures>(const Device&, const Comparison&)>& measure);

private:
    bool takes(int& i, int argc, char** argv);
};

/// Every method in each of the views, with the floors: rays of a twentieth of the width, circles up to a thirtieth; and, in views
/// less than 3840 wide, `ssao` with rays of two fifths and `dof` with a quarter of the circle too. Wider ones have the library's
/// qualities and methods on floats alone. Those that were swept are timed at `error_size` or less only. What takes longer than
/// `longest_run` is left out of the wider views that follow.
std::vector<Figures> presets(const Device& device, const std::vector<Method>& methods, const std::vector<View>& views,
                             const Effort& effort);

/// One method of each operation from 0.1 megapixels on; rays of 96 pixels, circles up to 64, as 1920 × 1080 has in `presets`.
std::vector<Figures> pixel_sweep(const Device& device, const std::vector<Method>& methods, double megapixels,
                                 const Effort& effort);

/// The presets of ssao with ever longer rays, and of dof with ever larger circles: those of the accurate one, which takes by
/// far the longest, end at `largest_accurate_px`.
std::vector<Figures> radius_sweep(const Device& device, const std::vector<Method>& methods, Size size,
                                  const Effort& effort);

} // namespace fathom::bench
