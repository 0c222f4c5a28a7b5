// The pictures of docs/research.md, drawn anew from the library's answers and from a small rasteriser:
// Lengyel's Figure 5, Kooima's curves, Goldberg's derivatives.

#include "article_pictures.hpp"

#include "articles/curves.hpp"
#include "articles/rasteriser.hpp"
#include "chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <sstream>

namespace fathom::charts {
namespace {

using Look = Series::Look;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr const char* dark = "fill='#1f2328'";
constexpr const char* clamped_color = "#c9ced6";

std::string small(const char* fill = "#57606a") {
    return std::string("font-size='12' fill='") + fill + "'";
}

// Dark blue over green to yellow, 0 to 1.
std::string color(double share) {
    constexpr double stops[5][3] = {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}};
    const double at = std::clamp(share, 0.0, 1.0) * 4;
    const std::size_t first = std::min<std::size_t>(static_cast<std::size_t>(at), 3);
    const double rest = at - static_cast<double>(first);
    int mixed[3];
    for (std::size_t i = 0; i < 3; ++i)
        mixed[i] = static_cast<int>(std::lround(stops[first][i] * (1 - rest) + stops[first + 1][i] * rest));
    char text[8];
    std::snprintf(text, sizeof text, "#%02x%02x%02x", static_cast<unsigned>(mixed[0]) & 0xffu,
                  static_cast<unsigned>(mixed[1]) & 0xffu, static_cast<unsigned>(mixed[2]) & 0xffu);
    return text;
}

// The scale of `color`, upright, with ticks at shares of its height.
void color_bar(std::ostream& out, double x, double y, double height,
               const std::vector<std::pair<double, const char*>>& ticks) {
    constexpr int parts = 64;
    for (int i = 0; i < parts; ++i)
        out << "<rect x='" << number(x) << "' y='" << number(y + height * (parts - 1 - i) / parts)
            << "' width='14' height='" << number(height / parts + 0.6) << "' fill='" << color((i + 0.5) / parts)
            << "'/>";
    for (const auto& [share, text] : ticks)
        draw_text(out, x + 20, y + height * (1 - share) + 4, text, "start", small());
}

// A surface over two axes from 0 to 1, heights from 0 to 1, seen from the corner (1, 0).
struct Space {
    double x, y; // of that corner's foot

    std::pair<double, double> at(double u, double v, double height) const {
        return {x - 215 * (1 - u) + 165 * v, y - 60 * (1 - u) - 76 * v - 165 * height};
    }
    std::string point(double u, double v, double height) const {
        const auto [px, py] = at(u, v, height);
        return number(px) + " " + number(py);
    }
};

void draw_surface(std::ostream& out, const Space& space) {
    const auto line = [&](double u, double v, double h, double u2, double v2, double h2, const char* stroke) {
        out << "<path fill='none' stroke='" << stroke << "' d='M" << space.point(u, v, h) << "L"
            << space.point(u2, v2, h2) << "'/>";
    };
    // The floor, and the wall behind.
    for (const double part : {0.0, 1 / 3.0, 2 / 3.0, 1.0})
        line(part, 0, 0, part, 1, 0, "#e4e7eb");
    for (const double part : {0.0, 0.25, 0.5, 0.75, 1.0})
        line(0, part, 0, 1, part, 0, "#e4e7eb");
    for (const double height : {0.0, 0.5, 1.0}) {
        line(0, 0, height, 0, 1, height, "#e4e7eb");
        line(0, 1, height, 1, 1, height, "#e4e7eb");
    }
    line(0, 1, 0, 0, 1, 1, "#e4e7eb");

    // Clamped from the distance at which the far plane cuts the axis to that at which nothing of the frustum is left.
    const auto clamped_from = [](double u) { return figure_5_edges.right * std::sin(u * std::numbers::pi / 2); };
    std::string plateau;
    for (int i = 0; i <= 60; ++i)
        plateau += (i ? "L" : "M") + space.point(i / 60.0, clamped_from(i / 60.0), 1);
    for (int i = 60; i >= 0; --i) {
        const double u = i / 60.0, nothing_left = clamped_from(u) + std::cos(u * std::numbers::pi / 2);
        plateau += "L" + space.point(u, std::min(nothing_left, 1.0), 1);
    }
    out << "<path fill='" << clamped_color << "' d='" << plateau << "z'/>\n";

    // Below 1, from the back to the front: distances as parts of the one from which it is clamped.
    constexpr int angles = 45, parts = 20;
    for (int i = 0; i < angles; ++i) {
        for (int j = parts - 1; j >= 0; --j) {
            constexpr std::array<std::array<int, 2>, 4> around{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
            double sum = 0;
            std::string path;
            for (const auto& [a, b] : around) {
                // Not quite to the ends, where the plane has no distance, or leaves nothing.
                const double u = std::min((i + a) / double{angles}, 0.99999);
                const double v = clamped_from(u) * std::clamp((j + b) / double{parts}, 1e-4, 1 - 1e-9);
                const double value = v > 0 ? std::min(depth_at_infinity(90 * u, v), 1.0) : 1;
                sum += value;
                path += (path.empty() ? "M" : "L") + space.point(u, v, (value + 1) / 2);
            }
            const std::string fill = color((sum / 4 + 1) / 2);
            out << "<path stroke='" << fill << "' stroke-width='0.5' fill='" << fill << "' d='" << path << "z'/>\n";
        }
    }
    for (const int degrees : {15, 30, 45, 60, 75}) { // lines of one angle
        std::string path;
        for (int j = 0; j <= parts; ++j) {
            const double v = clamped_from(degrees / 90.0) * std::clamp(j / double{parts}, 1e-4, 1 - 1e-9);
            path += (j ? "L" : "M") +
                    space.point(degrees / 90.0, v, (std::min(depth_at_infinity(degrees, v), 1.0) + 1) / 2);
        }
        out << "<path fill='none' stroke='#ffffff' stroke-opacity='0.8' d='" << path << "'/>\n";
    }

    // Axes: angle along the front left, distance along the front right, depth on the left.
    line(0, 0, 0, 1, 0, 0, "#57606a");
    line(1, 0, 0, 1, 1, 0, "#57606a");
    line(0, 0, 0, 0, 0, 1, "#57606a");
    for (const int degrees : {0, 30, 60, 90}) {
        const auto [x, y] = space.at(degrees / 90.0, 0, 0);
        draw_text(out, x - 6, y + 17, std::to_string(degrees) + "°", "middle", small());
    }
    for (const auto& [part, text] : {std::pair{0.25, "0.25"}, {0.5, "0.5"}, {0.75, "0.75"}, {1.0, "1"}}) {
        const auto [x, y] = space.at(1, part, 0);
        draw_text(out, x + 9, y + 12, text, "start", small());
    }
    for (const auto& [value, text] : {std::pair{-1, "−1"}, {0, "0"}, {1, "1"}}) {
        const auto [x, y] = space.at(0, 0, (value + 1) / 2.0);
        draw_text(out, x - 8, y + 4, text, "end", small());
    }
    const auto [ax, ay] = space.at(0.5, 0, 0);
    draw_text(out, ax - 32, ay + 44, "angle of the plane's normal", "middle", small());
    draw_text(out, ax - 32, ay + 59, "to the view axis", "middle", small());
    const auto [dx, dy] = space.at(1, 0.5, 0);
    draw_text(out, dx + 40, dy + 42, "distance of the plane", "start", small());
    draw_text(out, dx + 40, dy + 57, "from the camera / far", "start", small());
}

} // namespace

void draw_lengyel(const std::filesystem::path& folder) {
    constexpr double width = 1000, height = 430;
    std::ostringstream out;
    begin_card(out, "Greatest attainable normalised depth straight ahead", width, height);
    draw_text(out, 24, 24, "Greatest normalised depth straight ahead", "start",
              std::string("font-weight='600' font-size='14' ") + dark);
    draw_surface(out, {275, 355});
    color_bar(out, 478, 60, 120, {{0, "−1"}, {0.5, "0"}, {1, "1"}});
    out << "<rect x='478' y='192' width='14' height='14' fill='" << clamped_color << "'/>";
    draw_text(out, 498, 203, "clamped", "start", small());
    draw_text(out, 498, 218, "to 1", "start", small());

    Chart lines{"The same, for six distances",
                {"angle of the plane's normal to the view axis, degrees", 0, 90, {0, 15, 30, 45, 60, 75, 90}},
                {"normalised depth (near −1, far 1)", -1, 1.06, {-1, -0.5, 0, 0.5, 1}},
                {},
                24,
                std::pair{5.0, -0.05}};
    int next = 1;
    for (const auto& [distance, label] : {std::pair{0.5, "distance 0.5 far"},
                                          {0.4, "0.4 far"},
                                          {0.3, "0.3 far"},
                                          {0.2, "0.2 far"},
                                          {0.1, "0.1 far"},
                                          {0.001, "0.001 far"}}) {
        Series series{label, {}, next++, Look::line};
        for (double degrees = 0; degrees <= 90; degrees += 0.25) {
            if (leaves_something(degrees, distance))
                series.points.emplace_back(degrees, std::min(depth_at_infinity(degrees, distance), 1.0));
        }
        lines.series.push_back(std::move(series));
    }
    draw(out, lines, 555, 0, width - 555, height);
    end_card(folder / "lengyel-figure-5.svg", out);
}

void draw_kooima(const std::filesystem::path& folder) {
    const auto sampled = [](std::string label, int color, double from, auto depth, Look look = Look::line) {
        Series series{std::move(label), {}, color, look};
        for (int i = 0; i <= 400; ++i) {
            const double z = from + (10 - from) * i / 400;
            series.points.emplace_back(z, depth(z));
        }
        return series;
    };
    const Axis distance{"distance from the camera, scene units", 0, 10, {0, 2, 4, 6, 8, 10}};
    const Axis depth{"normalised depth", -1, 1.02, {-1, -0.5, 0, 0.5, 1}};
    const auto median = [](double m) { return [m](double z) { return median_depth(m, z); }; };
    std::ostringstream out;
    begin_card(out, "Normalised depth over the distance from the camera", 1000, 360);
    draw(out,
         {"Three projections",
          distance,
          depth,
          {sampled("standard, 1 to 10", 2, 1, [](double z) { return standard_depth(1, 10, z); }),
           sampled("infinite, from 1", 3, 1, [](double z) { return standard_depth(1, infinity, z); }),
           sampled("median 1", 1, 0, median(1))},
          130},
         0, 0, 520, 360);
    draw(out,
         {"Median depth for four medians",
          distance,
          depth,
          {sampled("median 1", 1, 0, median(1)), sampled("median 2", 5, 0, median(2)),
           sampled("median 3", 4, 0, median(3)), sampled("median 4", 6, 0, median(4))},
          80},
         520, 0, 480, 360);
    end_card(folder / "kooima.svg", out);
}

namespace {

constexpr double least_shown = 0.2, greatest_shown = 5; // times the mean

// One picture of derivatives over their mean: pixels of the same colour in a row are one rectangle.
void draw_derivative(std::ostream& out, const DepthPicture& picture, const std::vector<double>& derivative, double x,
                     double y, double pixel) {
    constexpr int levels = 48;
    const double mean =
        std::accumulate(derivative.begin(), derivative.end(), 0.0) / static_cast<double>(derivative.size());
    const auto level = [&](std::size_t at) {
        const double share = std::log(derivative[at] / mean / least_shown) / std::log(greatest_shown / least_shown);
        return std::clamp(static_cast<int>(std::lround(share * levels)), 0, levels);
    };
    std::map<int, std::string> paths;
    const auto width = static_cast<std::size_t>(picture.width);
    for (std::size_t row = 0; row < static_cast<std::size_t>(picture.height); ++row) {
        for (std::size_t begin = 0, end; begin < width; begin = end) {
            const int of = level(row * width + begin);
            for (end = begin + 1; end < width && level(row * width + end) == of;)
                ++end;
            const std::string run = std::to_string(end - begin);
            paths[of] += "M" + std::to_string(begin) + " " + std::to_string(row) + "h" + run + "v1h-" + run + "z";
        }
    }
    out << "<g transform='translate(" << number(x) << " " << number(y) << ") scale(" << number(pixel)
        << ")' shape-rendering='crispEdges'>\n";
    for (const auto& [of, path] : paths)
        out << "<path fill='" << color(static_cast<double>(of) / levels) << "' d='" << path << "'/>\n";
    out << "</g>\n";
}

void draw_edges(std::ostream& out, const std::vector<Triangle>& triangles, const Screen& screen, double x, double y,
                double pixel) {
    out << "<path fill='none' stroke='#ffffff' stroke-opacity='0.45' stroke-width='0.8' d='";
    for (const Triangle& triangle : triangles) {
        char command = 'M';
        const ScreenTriangle seen(triangle, screen, DepthWriter::z_over_w);
        for (const ScreenCorner& corner : seen.corners()) {
            out << command << number(x + corner.x * pixel) << " " << number(y + corner.y * pixel);
            command = 'L';
        }
        out << "z";
    }
    out << "'/>\n";
}

} // namespace

void draw_goldberg(const std::filesystem::path& folder) {
    constexpr double pixel = 2.2, left = 70, top = 60, gap = 16, width = 1000, height = 780;
    const Screen screen = slanted_screen(120, 90);
    const auto triangles = slanted_plane(screen);
    const double panel_width = screen.width * pixel, panel_height = screen.height * pixel;

    std::ostringstream out;
    begin_card(out, "Screen derivatives of three kinds of depth over one plane", width, height);
    Chart row{"Along the middle row, from left to right",
              {"pixel", 0, 120, {0, 20, 40, 60, 80, 100, 120}},
              {"∂/∂x over its mean", 0, 2.2, {0, 0.5, 1, 1.5, 2}},
              {},
              150};
    struct Column {
        DepthWriter writer;
        const char *title, *label;
        int color;
    };
    const Column columns[] = {{DepthWriter::z_over_w, "z/w: constant", "z/w", 0},
                              {DepthWriter::linear, "true linear: smooth", "true linear", 1},
                              {DepthWriter::z_times_w, "z·w: one value a triangle", "z·w per vertex", 2}};
    double x = left;
    for (const Column& column : columns) {
        const DepthPicture picture = rasterise(triangles, screen, column.writer);
        draw_text(out, x, 48, column.title, "start", std::string("font-weight='600' font-size='14' ") + dark);
        double y = top;
        for (const std::vector<double>* derivative : {&picture.dx, &picture.dy}) {
            draw_derivative(out, picture, *derivative, x, y, pixel);
            draw_edges(out, triangles, screen, x, y, pixel);
            y += panel_height + gap;
        }
        Series series{column.label, {}, column.color, Look::line};
        const auto all = static_cast<double>(picture.dx.size());
        const double mean = std::accumulate(picture.dx.begin(), picture.dx.end(), 0.0) / all;
        for (int at = 0; at < screen.width; ++at) {
            const auto place = static_cast<std::size_t>(screen.height / 2 * screen.width + at);
            series.points.emplace_back(at + 0.5, picture.dx[place] / mean);
        }
        row.series.push_back(std::move(series));
        x += panel_width + gap;
    }
    const std::pair<double, const char*> names[] = {{top + panel_height / 2, "∂/∂x"},
                                                    {top + panel_height * 1.5 + gap, "∂/∂y"}};
    for (const auto& [y, name] : names)
        draw_text(out, left - 12, y, name, "end", std::string("font-size='14' ") + dark);
    draw_text(out, left, 24, "Change of the stored depth from one pixel to the next, over its mean", "start", small());
    const auto share = [](double value) {
        return std::log(value / least_shown) / std::log(greatest_shown / least_shown);
    };
    draw_text(out, x + 6, 48, "× mean", "start", small());
    color_bar(out, x + 8, top, 2 * panel_height + gap,
              {{0, "0.2"}, {share(0.5), "0.5"}, {share(1), "1"}, {share(2), "2"}, {1, "5"}});
    draw(out, row, 8, top + 2 * panel_height + 2 * gap, width - 8, height - top - 2 * panel_height - 2 * gap);
    end_card(folder / "goldberg.svg", out);
}

} // namespace fathom::charts
