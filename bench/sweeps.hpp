#pragma once

#include "figures.hpp"
#include "methods.hpp"

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace fathom::bench {

/// How long to measure.
struct Effort {
    int rounds = 31;
    double seconds = 2; ///< no method takes more in all, but three runs
    Clock clock = Clock::wall;
    std::string only = {};
    std::function<void(const Figures&)> report = {}; ///< told of every row as soon as it is there
};

/// What the programs that compare others with fathom take, and its standard values.
struct Comparison {
    Effort effort;
    int width = 1920, height = 1080;
    std::string csv = {};

    /// Takes --size, --rounds, --seconds, --processor-time and --csv, and `program` after the option `of_program`, if that is given.
    /// An exit status where nothing else is to be done: after `help`, which an unknown argument brings, too.
    std::optional<int> read(int argc, char** argv, const char* help, const char* of_program = "",
                            std::string* program = nullptr);

private:
    bool takes(int& i, int argc, char** argv);
};

inline constexpr double longest_run = 2.5; ///< seconds

inline constexpr double largest_accurate_px = 128;

using Size = std::pair<int, int>;

/// What errors are measured at, and times too.
inline constexpr Size error_size{960, 540};

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
