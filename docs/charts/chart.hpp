#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// Small line charts as SVG, without a plotting package.
namespace fathom::charts {

struct Axis {
    std::string label;
    double from, to;
    std::vector<double> ticks{};
    bool logarithmic = false;
};

struct Series {
    enum class Look { line, dashed, thin, dots };
    std::string label; ///< written beside the last point; may be empty
    std::vector<std::pair<double, double>> points;
    int color = 0; ///< 0 grey, then one to six
    Look look = Look::line;
};

struct Chart {
    std::string title;
    Axis x, y;
    std::vector<Series> series;
    double label_room = 150; ///< pixels on the right for the labels of the series
};

/// Writes charts side by side into one picture.
void write(const std::filesystem::path& file, const std::vector<Chart>& charts, double width = 860,
           double height = 360);

} // namespace fathom::charts
