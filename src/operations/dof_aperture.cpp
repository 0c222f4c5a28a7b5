// Apertures as spans of columns. An aperture is cut into fine horizontal lines; each is one chord, for it is convex. A small
// one keeps the share of every pixel, as nested spans whose weights add up to it; a large one has one span of whole pixels a
// row, whose rounding is carried from row to row, so that no edge across many rows sees it.

#include "operations/dof_aperture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace fathom {
namespace {

// Lines that a row of pixels is cut into; small apertures, whose ends lie anywhere in a row, need more.
int lines_per_pixel(double height) {
    return height < 8 ? 64 : 16;
}

// Sums of weights must stay below 2^24 steps of the product of a share (2^-7) and a weight.
constexpr int bits_of_sum = 24 - 7;

// From this area on spans are of whole pixels: that of a circle of radius 16.
constexpr double least_whole = 804;

struct Interval {
    double low, high;
    double length() const { return high - low; }
};

struct Point {
    double x, y;
};

// Corners of the unit aperture, y up; none for a circle.
std::vector<Point> corners(const Aperture& aperture) {
    std::vector<Point> points;
    for (int i = 0; i < aperture.blades; ++i) {
        const double turn = (90 + aperture.rotation_degrees + 360.0 * i / aperture.blades) * std::numbers::pi / 180;
        points.push_back({std::cos(turn), std::sin(turn)});
    }
    return points;
}

// What a horizontal line crosses of the unit aperture.
std::optional<Interval> chord(const std::vector<Point>& corners, double y) {
    if (corners.empty()) {
        const double square = 1 - y * y;
        return square > 0 ? std::optional(Interval{-std::sqrt(square), std::sqrt(square)}) : std::nullopt;
    }
    Interval found{2, -2};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Point a = corners[i], b = corners[(i + 1) % corners.size()];
        if ((a.y <= y) == (b.y <= y))
            continue;
        const double x = a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
        found = {std::min(found.low, x), std::max(found.high, x)};
    }
    return found.low < found.high ? std::optional(found) : std::nullopt;
}

// Chords of one row of a strip, in pixels around the pixel's centre, evenly spaced, only those that there are.
struct Row {
    std::vector<Interval> chords;
    int lines; ///< that were tried
};

// How an aperture lies around a pixel.
struct Placed {
    std::vector<Point> corners;
    double radius, height; // in pixels
    bool behind;           // the focus: the pixel at offset (x, y) shows through the lens at -(x, y)
    bool upright;

    std::optional<Interval> chord(double down) const {
        const auto found = fathom::chord(corners, (behind == upright ? down : -down) / height);
        if (!found)
            return found;
        return behind ? Interval{-found->high * radius, -found->low * radius}
                      : Interval{found->low * radius, found->high * radius};
    }
};

Row row_of(const Placed& aperture, double top, int pitch) {
    const int each = lines_per_pixel(aperture.height);
    Row row{{}, pitch * each};
    for (int i = 0; i < row.lines; ++i) {
        if (const auto found = aperture.chord(top + (i + 0.5) / each))
            row.chords.push_back(*found);
    }
    return row;
}

// Nested spans whose weights add up to the share of each pixel that the chords cover.
void add_shares(const Row& row, int columns, double step, std::vector<params::span_params>& spans) {
    std::vector<double> shares(static_cast<std::size_t>(2 * columns + 3), 0.0);
    for (const Interval& chord : row.chords) {
        for (int x = -columns; x <= columns; ++x) {
            const double covered = std::min(chord.high, x + 0.5) - std::max(chord.low, x - 0.5);
            shares[static_cast<std::size_t>(x + columns + 1)] += std::max(covered, 0.0) / row.lines;
        }
    }
    for (double& share : shares)
        share = std::round(share / step) * step;
    // The profile rises and then falls: the last rise that is open is closed by the next fall.
    std::vector<std::pair<int, double>> open;
    for (std::size_t i = 1; i < shares.size(); ++i) {
        const int x = static_cast<int>(i) - columns - 1;
        double change = shares[i] - shares[i - 1];
        if (change > 0)
            open.emplace_back(x, change);
        while (change < 0) {
            auto& [low, height] = open.back();
            const double weight = std::min(height, -change);
            spans.push_back({low, x, static_cast<float>(weight)});
            height -= weight;
            change += weight;
            if (height == 0)
                open.pop_back();
        }
    }
}

// What rounding the ends of the rows so far has left over.
struct Carried {
    double low = 0, high = 0;
};

// One span of whole pixels as long as the chords on average.
void add_whole(const Row& row, Carried& carried, std::vector<params::span_params>& spans) {
    double low = 0, high = 0, middle = 0, length = 0;
    for (const Interval& chord : row.chords) {
        length += chord.length() / row.lines;
        middle += (chord.low + chord.high) / 2 * chord.length() / row.lines;
    }
    if (!(length > 0))
        return;
    low = middle / length - length / 2 + 0.5 + carried.low;
    high = middle / length + length / 2 + 0.5 + carried.high;
    const double first = std::round(low), end = std::round(high);
    carried = {low - first, high - end};
    if (first < end)
        spans.push_back({static_cast<int>(first), static_cast<int>(end), 1});
}

} // namespace

ApertureSpans aperture_spans(const Aperture& aperture, double circle, double aspect, bool upright, int pitch) {
    const double radius = std::abs(circle) / 2, height = radius * aspect;
    if (radius <= 0.5) // nothing is seen but the pixel
        return {0, 0, {0, 1}, {{0, 1, 1}}};
    const Placed placed{corners(aperture), radius, height, circle > 0, upright};
    ApertureSpans result{};
    result.columns = static_cast<int>(std::ceil(radius - 0.5));
    const int rows = static_cast<int>(std::ceil(height - 0.5));
    result.reach = (rows + pitch - 1) / pitch;
    const double area = 4 * radius * height + 2 * radius + 1;
    const int bits = std::clamp(bits_of_sum - static_cast<int>(std::ceil(std::log2(area))), 0, 12);
    const double step = std::ldexp(1.0, -bits);
    const double corner = 2 * std::numbers::pi / std::max(aperture.blades, 1);
    const double unit = aperture.blades ? aperture.blades * std::sin(corner) / 2 : std::numbers::pi;
    const bool whole = unit * radius * height >= least_whole;

    const int count = 2 * result.reach + 1;
    for (int phase = 0; phase < pitch; ++phase) {
        const auto row = [&](int r) { return row_of(placed, r * pitch - phase - 0.5, pitch); };
        std::vector<std::vector<params::span_params>> spans(static_cast<std::size_t>(count));
        const auto at = [&](int r) -> auto& {
            return spans[static_cast<std::size_t>(r + result.reach)];
        };
        if (whole) { // from the middle outwards, so that what is symmetric stays so
            Carried up, down;
            add_whole(row(0), up, at(0));
            down = up;
            for (int r = 1; r <= result.reach; ++r) {
                add_whole(row(-r), up, at(-r));
                add_whole(row(r), down, at(r));
            }
        } else {
            for (int r = -result.reach; r <= result.reach; ++r)
                add_shares(row(r), result.columns, step, at(r));
        }
        for (const auto& of_row : spans) {
            result.starts.push_back(static_cast<params::u32>(result.spans.size()));
            result.spans.insert(result.spans.end(), of_row.begin(), of_row.end());
        }
    }
    result.starts.push_back(static_cast<params::u32>(result.spans.size()));
    return result;
}

} // namespace fathom
