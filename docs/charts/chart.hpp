#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
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
    std::optional<std::pair<double, double>>
        legend{}; ///< x and y of a list of the labels, instead of labels at the ends
};

/// Writes charts side by side into one picture.
void write(const std::filesystem::path& file, const std::vector<Chart>& charts, double width = 860,
           double height = 360);

/// The parts of `write`, for a picture that holds more than charts: a white card, and a chart on it.
void begin_card(std::ostream& out, const std::string& title, double width, double height);
void draw(std::ostream& out, const Chart& chart, double x, double y, double width, double height);
void end_card(const std::filesystem::path& file, std::ostringstream& out);

/// Text on a card. `style`: further attributes.
void draw_text(std::ostream& out, double x, double y, const std::string& what, const std::string& anchor,
               const std::string& style);

/// A coordinate with one decimal.
std::string number(double value);

} // namespace fathom::charts
