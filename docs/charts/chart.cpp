// Line charts as SVG: a white card that reads on light and dark pages, labels at the ends of the lines.

#include "chart.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace fathom::charts {
namespace {

constexpr const char* colors[] = {"#8a8f98", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9"};
constexpr double top = 44, bottom = 52, left = 62; // margins of a chart

// 1e-06 as 10⁻⁶, everything else as it is.
std::string tick_text(const Axis& axis, double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%g", value);
    const double power = std::log10(std::abs(value));
    if (!axis.logarithmic || std::abs(power) < 3 || power != std::round(power))
        return value < 0 ? "−" + std::string(buffer + 1) : buffer;
    static constexpr const char* digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string text = power < 0 ? "10⁻" : "10";
    for (const char digit : std::to_string(std::lround(std::abs(power))))
        text += digits[digit - '0'];
    return text;
}

double share(const Axis& axis, double value) {
    return axis.logarithmic ? std::log(value / axis.from) / std::log(axis.to / axis.from)
                            : (value - axis.from) / (axis.to - axis.from);
}

class Drawing {
public:
    Drawing(std::ostream& out, const Chart& chart, double x, double y, double width, double height)
        : out_(out), chart_(chart), x_(x + left), y_(y + top), width_(width - left - chart.label_room),
          height_(height - top - bottom) {}

    void draw() {
        text(x_, y_ - top + 24, chart_.title, "start", "font-weight='600' font-size='14' fill='#1f2328'");
        axes();
        const std::string clip =
            "c" + std::to_string(std::lround(x_)) + (y_ > top ? "-" + std::to_string(std::lround(y_)) : "");
        out_ << "<clipPath id='" << clip << "'><rect x='" << number(x_) << "' y='" << number(y_ - 1) << "' width='"
             << number(width_ + 1) << "' height='" << number(height_ + 2) << "'/></clipPath>\n<g clip-path='url(#"
             << clip << ")'>\n";
        for (const Series& series : chart_.series)
            line(series);
        out_ << "</g>\n";
        if (chart_.legend)
            legend();
        else
            labels();
    }

private:
    double at_x(double value) const { return x_ + width_ * share(chart_.x, value); }
    double at_y(double value) const { return y_ + height_ * (1 - share(chart_.y, value)); }

    void text(double x, double y, const std::string& what, const char* anchor, const std::string& style) {
        draw_text(out_, x, y, what, anchor, style);
    }

    void axes() {
        out_ << "<g stroke='#e4e7eb' fill='#57606a' font-size='11'>\n";
        for (const double tick : chart_.x.ticks) {
            const double x = at_x(tick);
            out_ << "<path d='M" << number(x) << " " << number(y_) << "v" << number(height_) << "'/>";
            text(x, y_ + height_ + 17, tick_text(chart_.x, tick), "middle", "stroke='none'");
        }
        for (const double tick : chart_.y.ticks) {
            const double y = at_y(tick);
            out_ << "<path d='M" << number(x_) << " " << number(y) << "h" << number(width_) << "'/>";
            text(x_ - 8, y + 4, tick_text(chart_.y, tick), "end", "stroke='none'");
        }
        text(x_ + width_ / 2, y_ + height_ + 38, chart_.x.label, "middle", "stroke='none' font-size='12'");
        const double x = x_ - 46, y = y_ + height_ / 2;
        text(x, y, chart_.y.label, "middle",
             "stroke='none' font-size='12' transform='rotate(-90 " + number(x) + " " + number(y) + ")'");
        out_ << "</g>\n";
    }

    void line(const Series& series) {
        const std::string color = colors[series.color];
        if (series.look == Series::Look::dots) {
            out_ << "<g fill='" << color << "' fill-opacity='0.6'>";
            for (const auto& [x, y] : series.points)
                out_ << "<circle cx='" << number(at_x(x)) << "' cy='" << number(at_y(y)) << "' r='2.4'/>";
            out_ << "</g>\n";
            return;
        }
        out_ << "<path fill='none' stroke='" << color << "' stroke-width='"
             << (series.look == Series::Look::thin ? "1" : "2") << "' stroke-linejoin='round'"
             << (series.look == Series::Look::dashed ? " stroke-dasharray='5 4'" : "") << " d='";
        char command = 'M';
        for (const auto& [x, y] : series.points) {
            const bool drawn = std::isfinite(x) && std::isfinite(y);
            if (drawn)
                out_ << command << number(at_x(x)) << " " << number(std::clamp(at_y(y), -9e3, 9e3));
            command = drawn ? 'L' : 'M';
        }
        out_ << "'/>\n";
    }

    // A list of all labels, each beside a piece of its line.
    void legend() {
        double y = at_y(chart_.legend->second);
        const double x = at_x(chart_.legend->first);
        for (const Series& series : chart_.series) {
            if (series.label.empty())
                continue;
            const std::string color = colors[series.color];
            out_ << "<path stroke='" << color << "' stroke-width='2'"
                 << (series.look == Series::Look::dashed ? " stroke-dasharray='5 4'" : "") << " d='M" << number(x)
                 << " " << number(y) << "h22'/>";
            text(x + 29, y + 4, series.label, "start", "font-size='12' fill='" + color + "'");
            y += 17;
        }
    }

    // Beside the last point that is inside, moved apart where they would cover each other.
    void labels() {
        struct Label {
            double x, y;
            const Series* series;
        };
        std::vector<Label> all;
        for (const Series& series : chart_.series) {
            if (series.label.empty())
                continue;
            Label label{x_, y_, &series};
            for (const auto& [x, y] : series.points) {
                if (std::isfinite(y) && share(chart_.x, x) <= 1.001)
                    label = {at_x(x), std::clamp(at_y(y), y_ + 4, y_ + height_), &series};
            }
            all.push_back(label);
        }
        std::sort(all.begin(), all.end(), [](const Label& a, const Label& b) { return a.y < b.y; });
        for (int pass = 0; pass < 50; ++pass) {
            for (Label& label : all)
                label.y = std::max(label.y, y_ + 4);
            for (std::size_t i = 1; i < all.size(); ++i) {
                const double overlap = 15 - (all[i].y - all[i - 1].y);
                if (overlap > 0 && std::abs(all[i].x - all[i - 1].x) < 120) {
                    all[i - 1].y -= overlap / 2;
                    all[i].y += overlap / 2;
                }
            }
        }
        for (const Label& label : all)
            text(label.x + 7, label.y + 4, label.series->label, "start",
                 std::string("font-size='12' fill='") + colors[label.series->color] + "'");
    }

    std::ostream& out_;
    const Chart& chart_;
    double x_, y_, width_, height_;
};

} // namespace

std::string number(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.1f", value + 0.0);
    return buffer;
}

void draw_text(std::ostream& out, double x, double y, const std::string& what, const std::string& anchor,
               const std::string& style) {
    out << "<text x='" << number(x) << "' y='" << number(y) << "' text-anchor='" << anchor << "' " << style << ">"
        << what << "</text>\n";
}

void begin_card(std::ostream& out, const std::string& title, double width, double height) {
    out << "<svg xmlns='http://www.w3.org/2000/svg' width='" << width << "' height='" << height << "' viewBox='0 0 "
        << width << " " << height << "' font-family='-apple-system,Segoe UI,Helvetica,Arial,sans-serif'>\n";
    if (!title.empty())
        out << "<title>" << title << "</title>\n";
    out << "<rect width='" << width << "' height='" << height << "' rx='8' fill='#ffffff'/>\n";
}

void draw(std::ostream& out, const Chart& chart, double x, double y, double width, double height) {
    Drawing(out, chart, x, y, width, height).draw();
}

void end_card(const std::filesystem::path& file, std::ostringstream& out) {
    out << "</svg>\n";
    std::ofstream target(file, std::ios::binary);
    target << out.str();
    if (!target.flush())
        throw std::runtime_error("cannot write " + file.string());
}

void write(const std::filesystem::path& file, const std::vector<Chart>& charts, double width, double height) {
    std::ostringstream out;
    begin_card(out, "", width, height);
    const double each = width / static_cast<double>(charts.size());
    for (std::size_t i = 0; i < charts.size(); ++i)
        draw(out, charts[i], each * static_cast<double>(i), 0, each, height);
    end_card(file, out);
}

} // namespace fathom::charts
