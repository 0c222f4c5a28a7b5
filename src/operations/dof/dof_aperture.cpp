// Apertures as spans of columns. An aperture is cut into fine horizontal lines; each is one chord, for it is convex. A small
// one keeps the fraction of every pixel, as nested spans whose weights add up to it. A large one has one span of whole
// pixels a row; its rounding is carried from row to row, so that it averages out along an edge.

#include "operations/dof/dof_aperture.hpp"

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

// Sums of weights must stay below 2^24 steps of the product of a fraction (2^-9) and a weight.
constexpr int bits_of_sum = 24 - 9;

// Radii from which on the ends of spans are rounded, to a half of a pixel and to whole pixels. What rounding leaves over
// averages out along a curve; the sides of polygons may lie along the rows.
struct RoundedFrom {
    double half, whole;
};
RoundedFrom rounded_from(const Aperture& aperture, Quality quality) {
    if (aperture.blades != 0 || quality == Quality::accurate)
        return {16, 16};
    return quality == Quality::fast ? RoundedFrom{4, 8} : RoundedFrom{5.3, 10.6};
}

struct Interval {
    double low, high;
    double length() const { return high - low; }
};

struct Point {
    double x, y;
};

// A polygon's corners, or an ellipse's axes; y up.
struct ApertureShape {
    std::vector<Point> corners;
    double across = 1, up = 1;   // half the axes of the ellipse before it is turned
    double cosine = 1, sine = 0; // of the angle by which it is turned
};

std::vector<Point> corners_of(const Aperture& aperture) {
    std::vector<Point> points;
    for (int i = 0; i < aperture.blades; ++i) {
        const double turn = (90 + aperture.rotation_degrees + 360.0 * i / aperture.blades) * std::numbers::pi / 180;
        points.push_back({std::cos(turn), std::sin(turn)});
    }
    return points;
}

ApertureShape aperture_shape_of(const Aperture& aperture) {
    ApertureShape aperture_shape{.corners = corners_of(aperture)};
    if (!is_round(aperture) && aperture_shape.corners.empty()) {
        aperture_shape.across = std::min(1.0, 1 / aperture.ratio);
        aperture_shape.up = std::min(1.0, aperture.ratio);
        aperture_shape.cosine = std::cos(aperture.rotation_degrees * std::numbers::pi / 180);
        aperture_shape.sine = std::sin(aperture.rotation_degrees * std::numbers::pi / 180);
    }
    return aperture_shape;
}

// How far the unit aperture reaches to the sides, and up.
Point reach_of(const ApertureShape& aperture_shape) {
    return {std::hypot(aperture_shape.across * aperture_shape.cosine, aperture_shape.up * aperture_shape.sine),
            std::hypot(aperture_shape.across * aperture_shape.sine, aperture_shape.up * aperture_shape.cosine)};
}

double area_of(const ApertureShape& aperture_shape) {
    if (aperture_shape.corners.empty())
        return std::numbers::pi * aperture_shape.across * aperture_shape.up;
    const auto count = static_cast<double>(aperture_shape.corners.size());
    return count * std::sin(2 * std::numbers::pi / count) / 2;
}

// What a horizontal line crosses of the unit ellipse: xx x^2 + 2 xy x y + yy y^2 <= 1.
std::optional<Interval> chord_of_ellipse(const ApertureShape& aperture_shape, double y) {
    const double a = 1 / (aperture_shape.across * aperture_shape.across),
                 b = 1 / (aperture_shape.up * aperture_shape.up);
    const double xx = aperture_shape.cosine * aperture_shape.cosine * a + aperture_shape.sine * aperture_shape.sine * b;
    const double xy = aperture_shape.cosine * aperture_shape.sine * (a - b), square = xx - a * b * y * y;
    if (!(square > 0))
        return std::nullopt;
    const double root = std::sqrt(square);
    return Interval{(-xy * y - root) / xx, (-xy * y + root) / xx};
}

// What a horizontal line crosses of the unit polygon.
std::optional<Interval> chord_of_polygon(const std::vector<Point>& corners, double y) {
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

std::optional<Interval> chord(const ApertureShape& aperture_shape, double y) {
    return aperture_shape.corners.empty() ? chord_of_ellipse(aperture_shape, y)
                                          : chord_of_polygon(aperture_shape.corners, y);
}

// Chords of one row of a strip, in pixels around the pixel's centre, evenly spaced, only those that there are.
struct Row {
    std::vector<Interval> chords;
    int lines; ///< as many as there could be; the aperture may miss some
};

// How an aperture lies around a pixel.
struct Placed {
    ApertureShape aperture_shape;
    double radius, height; // of the circle of confusion, in pixels
    bool behind;           // the focus: the pixel at offset (x, y) shows through the lens at -(x, y)
    bool upright;

    std::optional<Interval> chord(double down) const {
        const auto found = fathom::chord(aperture_shape, (behind == upright ? down : -down) / height);
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

// The fraction of each pixel of a row that the chords cover, from before the first column to beyond the last.
std::vector<double> coverage_of(const Row& row, int columns) {
    std::vector<double> coverage(static_cast<std::size_t>(2 * columns + 3), 0.0);
    for (const Interval& chord : row.chords) {
        for (int x = -columns; x <= columns; ++x) {
            const double covered = std::min(chord.high, x + 0.5) - std::max(chord.low, x - 0.5);
            coverage[static_cast<std::size_t>(x + columns + 1)] += std::max(covered, 0.0) / row.lines;
        }
    }
    return coverage;
}

// Nested spans whose weights add up to the fraction of each pixel that the chords cover.
void add_coverage(const Row& row, int columns, double step, std::vector<params::span_params>& spans) {
    std::vector<double> coverage = coverage_of(row, columns);
    for (double& part : coverage)
        part = std::round(part / step) * step;
    if (columns <= 2) { // read pixel by pixel: each once
        for (std::size_t i = 1; i + 1 < coverage.size(); ++i) {
            const int x = static_cast<int>(i) - columns - 1;
            if (coverage[i] > 0)
                spans.push_back({x, x + 1, static_cast<float>(coverage[i])});
        }
        return;
    }
    // The profile rises and then falls: the last rise that is open is closed by the next fall.
    std::vector<std::pair<int, double>> open;
    for (std::size_t i = 1; i < coverage.size(); ++i) {
        const int x = static_cast<int>(i) - columns - 1;
        double change = coverage[i] - coverage[i - 1];
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

// One span as long as the chords on average, its ends rounded to multiples of 1 / `parts` of a pixel, 1 or 2; of halves, the mean
// of two spans.
void add_rounded(const Row& row, int parts, Carried& carried, std::vector<params::span_params>& spans) {
    double low = 0, high = 0, middle = 0, length = 0;
    for (const Interval& chord : row.chords) {
        length += chord.length() / row.lines;
        middle += (chord.low + chord.high) / 2 * chord.length() / row.lines;
    }
    if (!(length > 0))
        return;
    low = middle / length - length / 2 + 0.5 + carried.low;
    high = middle / length + length / 2 + 0.5 + carried.high;
    const double first = std::round(parts * low) / parts, end = std::round(parts * high) / parts;
    carried = {low - first, high - end};
    const auto add = [&](double from, double to, float weight) {
        if (from < to)
            spans.push_back({static_cast<int>(from), static_cast<int>(to), weight});
    };
    const double outer = std::floor(first), outer_end = std::ceil(end);
    if (outer == first && outer_end == end) {
        add(first, end, 1);
    } else if (first < end) {
        add(outer, outer_end, 0.5F);
        add(std::ceil(first), std::floor(end), 0.5F);
    }
}

} // namespace

bool is_round(const Aperture& aperture) {
    return aperture.blades == 0 && aperture.ratio == 1;
}

double thinnest(const Aperture& aperture) {
    return std::min(aperture.ratio, 1 / aperture.ratio);
}

ApertureSpans aperture_spans(const Aperture& aperture, double circle, double aspect, bool upright, int pitch,
                             Quality quality) {
    const double radius = std::abs(circle) / 2, height = radius * aspect;
    if (radius <= 0.5) // the circle is within the pixel
        return {0, 0, {0, 1}, {{0, 1, 1}}};
    // A strip's rows widen what is summed by (pitch^2 - 1) / 6 in variance: the rows' places in it, and the aperture's in them.
    const double wider = quality == Quality::accurate || aperture.blades != 0 ? 0 : (pitch * pitch - 1) / 6.0;
    const ApertureShape shape = aperture_shape_of(aperture);
    const Point far = reach_of(shape);
    const Placed placed{shape, radius,
                        std::sqrt(std::max(height * height - 4 * wider / (far.y * far.y), height * height / 4)),
                        circle > 0, upright};
    ApertureSpans result{};
    result.columns = std::max(static_cast<int>(std::ceil(radius * far.x - 0.5)), 0);
    const int rows = std::max(static_cast<int>(std::ceil(placed.height * far.y - 0.5)), 0);
    result.reach = (rows + pitch - 1) / pitch;
    const double area = 4 * radius * far.x * height * far.y + 2 * radius + 1;
    const int bits = std::clamp(bits_of_sum - static_cast<int>(std::ceil(std::log2(area))), 0, 12);
    const double step = std::ldexp(1.0, -bits);
    const double equal_radius = std::sqrt(area_of(placed.aperture_shape) * radius * height / std::numbers::pi);
    const RoundedFrom from = rounded_from(aperture, quality);
    const int parts = equal_radius >= from.whole ? 1 : 2;

    const int count = 2 * result.reach + 1;
    for (int phase = 0; phase < pitch; ++phase) {
        const auto row = [&](int r) { return row_of(placed, r * pitch - phase - 0.5, pitch); };
        std::vector<std::vector<params::span_params>> spans(static_cast<std::size_t>(count));
        const auto at = [&](int r) -> auto& {
            return spans[static_cast<std::size_t>(r + result.reach)];
        };
        if (equal_radius >= from.half) { // from the middle outwards, so that what is symmetric stays so
            Carried up, down;
            add_rounded(row(0), parts, up, at(0));
            down = up;
            for (int r = 1; r <= result.reach; ++r) {
                add_rounded(row(-r), parts, up, at(-r));
                add_rounded(row(r), parts, down, at(r));
            }
        } else {
            for (int r = -result.reach; r <= result.reach; ++r)
                add_coverage(row(r), result.columns, step, at(r));
        }
        for (const auto& of_row : spans) {
            result.starts.push_back(static_cast<params::u32>(result.spans.size()));
            result.spans.insert(result.spans.end(), of_row.begin(), of_row.end());
        }
    }
    result.starts.push_back(static_cast<params::u32>(result.spans.size()));
    return result;
}

namespace {

// Of the unit polygon along any axis; a quarter along the half axes of an ellipse.
double variance_of(const Aperture& aperture) {
    return aperture.blades == 0 ? 0.25 : (2 + std::cos(2 * std::numbers::pi / aperture.blades)) / 12;
}

// The same shape with a variance that is less by this.
ApertureShape narrowed(const Aperture& aperture, double variance) {
    const double most = variance / variance_of(aperture);
    ApertureShape result = aperture_shape_of(aperture);
    const auto less = [most](double half_axis) { return std::sqrt(half_axis * half_axis - most); };
    result.across = less(result.across);
    result.up = less(result.up);
    for (Point& corner : result.corners)
        corner = {corner.x * less(1), corner.y * less(1)};
    return result;
}

} // namespace

double aperture_area(const Aperture& aperture) {
    return area_of(aperture_shape_of(aperture));
}

double least_cells(const Aperture& aperture, Quality quality) {
    const double round = quality == Quality::fast ? 5 : 7;
    if (aperture.blades == 0)
        return round;
    // The error is greatest at the ends of an edge's ramp, along a side: in proportion to its part of the area.
    const double side = 2 / (aperture.blades * std::cos(std::numbers::pi / aperture.blades));
    return std::max(round, (quality == Quality::fast ? 16 : 32) * side);
}

ApertureCells aperture_cells(const Aperture& aperture, double circle, double aspect, bool upright, int cell, int rows) {
    const double radius = std::abs(circle) / 2 / cell, height = radius * aspect;
    // Of a cell: its pixels' places in it, the fractions of it that the aperture covers, and the interpolation; less a pixel's own.
    const double wider = 1.0 / 3 - 1.0 / (12 * cell * cell);
    const Placed placed{narrowed(aperture, wider / (radius * height)), radius, height, circle > 0, upright};
    const Point far = reach_of(placed.aperture_shape);
    const auto columns = static_cast<int>(std::ceil(radius * far.x - 0.5));
    ApertureCells result{static_cast<int>(std::ceil(height * far.y - 0.5)), {}, {}};
    const auto middle = static_cast<std::size_t>(columns + 1);
    std::vector<std::vector<double>> coverage; // of rows from -reach on
    for (int r = -result.reach; r <= result.reach; ++r)
        coverage.push_back(coverage_of(row_of(placed, r - 0.5, 1), columns));
    const std::vector<double> none(2 * middle + 1);
    for (int r = 0; r < 2 * result.reach + rows; ++r) {
        const auto of = [&](int i) -> const std::vector<double>& {
            return r < i || r - i > 2 * result.reach ? none : coverage[static_cast<std::size_t>(r - i)];
        };
        std::size_t aside = middle;
        const auto some = [&](std::size_t x) {
            for (int i = 0; i < rows; ++i)
                if (of(i)[middle - x] > 0 || of(i)[middle + x] > 0)
                    return true;
            return false;
        };
        while (aside > 0 && !some(aside))
            --aside;
        result.starts.push_back(static_cast<params::u32>(aside));
        result.starts.push_back(static_cast<params::u32>(result.weights.size()));
        for (std::size_t x = middle - aside; x <= middle + aside; ++x)
            for (int i = 0; i < rows; ++i)
                result.weights.push_back(static_cast<float>(of(i)[x]));
    }
    return result;
}

int parts_of_pixel(const Aperture& aperture, double circle, double aspect) {
    const double radius = std::abs(circle) / 2 * std::min(aspect, 1.0) * std::max(thinnest(aperture), 0.5);
    constexpr double finest = 4; // of a circle's radius, parts
    return std::abs(circle) <= 1 ? 1 : std::max(1, static_cast<int>(std::ceil(finest / radius)));
}

std::vector<params::aperture_tap_params> aperture_taps(const Aperture& aperture, double circle, double aspect,
                                                       bool upright) {
    const double radius = std::abs(circle) / 2, height = radius * aspect;
    if (radius <= 0.5)
        return {{0, 0, 1, 0, 0}};
    const Placed placed{aperture_shape_of(aperture), radius, height, circle > 0, upright};
    const double to_lens = circle > 0 ? -1 : 1;
    const int parts = parts_of_pixel(aperture, circle, aspect);
    const int columns = static_cast<int>(std::ceil(radius - 0.5)), rows = static_cast<int>(std::ceil(height - 0.5));
    const int across = (2 * columns + 1) * parts, down = (2 * rows + 1) * parts;
    constexpr int lines = 64; // of a part
    std::vector<params::aperture_tap_params> taps;
    double sum = 0;
    for (int j = 0; j < down; ++j) {
        std::vector<std::array<double, 3>> moments(static_cast<std::size_t>(across)); // weight and its moments
        for (int line = 0; line < lines; ++line) {
            const double y = (j + (line + 0.5) / lines) / parts - rows - 0.5;
            const auto found = placed.chord(y);
            for (int i = 0; found && i < across; ++i) {
                const double left = static_cast<double>(i) / parts - columns - 0.5;
                const double low = std::max(found->low, left), high = std::min(found->high, left + 1.0 / parts);
                if (low >= high)
                    continue;
                auto& [weight, u, v] = moments[static_cast<std::size_t>(i)];
                weight += high - low;
                u += (high - low) * (low + high) / 2 * to_lens / radius;
                v += (high - low) * y * to_lens / height;
                sum += high - low;
            }
        }
        for (int i = 0; i < across; ++i) {
            const auto& [weight, u, v] = moments[static_cast<std::size_t>(i)];
            if (weight > 0)
                taps.push_back({i / parts - columns, j / parts - rows, static_cast<float>(weight),
                                static_cast<float>(u / weight), static_cast<float>(v / weight)});
        }
    }
    std::ranges::stable_sort(taps, {}, [](const auto& tap) { return std::pair{tap.row, tap.column}; });
    for (params::aperture_tap_params& tap : taps)
        tap.weight = static_cast<float>(static_cast<double>(tap.weight) / sum);
    return taps;
}

namespace {

constexpr std::size_t fractions = params::dof_fractions;

// A half-plane of the aperture: its distance from the middle, the size of its first moment and by which angle this is turned
// from its normal.
struct HalfPlane {
    double distance, moment, lean;
};

ApertureShape turned(const ApertureShape& aperture_shape, double angle) { // so that this direction is on top
    ApertureShape result = aperture_shape;
    const double cosine = std::sin(angle), sine = std::cos(angle);
    for (Point& p : result.corners)
        p = {p.x * cosine - p.y * sine, p.x * sine + p.y * cosine};
    result.cosine = aperture_shape.cosine * cosine - aperture_shape.sine * sine;
    result.sine = aperture_shape.sine * cosine + aperture_shape.cosine * sine;
    return result;
}

// For every fraction of the aperture, the half-plane that leaves it open and whose normal is at this angle.
std::vector<HalfPlane> half_planes(const ApertureShape& aperture, double angle) {
    constexpr int lines = 1024;
    const ApertureShape aperture_shape = turned(aperture, angle);
    struct Sum { // of the lines down to this distance from the middle
        double distance, area, along, across;
    };
    std::vector<Sum> sums{{1, 0, 0, 0}};
    for (int line = 0; line < lines; ++line) {
        const double y = 1 - (2 * line + 1.0) / lines;
        const auto found = chord(aperture_shape, y);
        const double length = found ? found->length() : 0, middle = found ? (found->low + found->high) / 2 : 0;
        const Sum& before = sums.back();
        sums.push_back({1 - 2 * (line + 1.0) / lines, before.area + length, before.along + y * length,
                        before.across + middle * length});
    }
    std::vector<HalfPlane> result;
    std::size_t at = 0;
    for (std::size_t i = 0; i < fractions; ++i) {
        const double whole = sums.back().area, area = whole * static_cast<double>(i) / (fractions - 1);
        while (at + 2 < sums.size() && sums[at + 1].area <= area)
            ++at;
        const Sum &one = sums[at], &two = sums[at + 1];
        const double part = two.area > one.area ? std::clamp((area - one.area) / (two.area - one.area), 0.0, 1.0) : 0;
        const double along = std::lerp(one.along, two.along, part) / whole;
        const double across = std::lerp(one.across, two.across, part) / whole;
        const bool any = i > 0 && i + 1 < fractions; // the whole and nothing have no moment
        result.push_back({std::lerp(one.distance, two.distance, part), std::hypot(along, across),
                          any ? std::atan2(across, along) : 0});
    }
    return result;
}

// The angle of a direction: y / (|x| + |y|), counted on beyond 1 where x is negative, goes in even steps.
double direction_at(int i, int directions) {
    const double around = 4.0 * i / directions - 1;
    const double y = around <= 1 ? around : 2 - around;
    return std::atan2(y, around <= 1 ? 1 - std::abs(y) : std::abs(y) - 1);
}

std::array<float, 4> entry_of(const HalfPlane& half, double turn) {
    return {static_cast<float>(std::cos(turn)), static_cast<float>(std::sin(turn)), static_cast<float>(half.distance),
            static_cast<float>(std::max(half.moment, 1e-6))};
}

} // namespace

std::vector<std::array<float, 4>> aperture_halves(const Aperture& aperture, bool upright) {
    ApertureShape aperture_shape = aperture_shape_of(aperture);
    for (Point& p : aperture_shape.corners)
        p.y = upright ? -p.y : p.y;
    aperture_shape.sine = upright ? -aperture_shape.sine : aperture_shape.sine;
    if (is_round(aperture)) {
        std::vector<std::array<float, 4>> table;
        for (const HalfPlane& half : half_planes(aperture_shape, 0))
            table.push_back(entry_of(half, 0));
        return table;
    }
    constexpr int directions = 64, normals = 256, aside = 24; // a corner's moment is up to 0.5 off its normal
    constexpr double step = 2 * std::numbers::pi / normals;
    std::vector<std::vector<HalfPlane>> known;
    for (int n = 0; n < normals; ++n)
        known.push_back(half_planes(aperture_shape, step * n));
    std::vector<std::array<float, 4>> table;
    for (int i = 0; i < directions; ++i) {
        const double moment = direction_at(i, directions);
        const int nearest = static_cast<int>(std::lround(moment / step));
        for (std::size_t f = 0; f < fractions;
             ++f) { // between the two normals whose moments lie on both sides of this direction
            int below = nearest - aside;
            const auto half = [&](int n) -> const HalfPlane& {
                return known[static_cast<std::size_t>((n + normals) % normals)][f];
            };
            const auto past = [&](int n) { return step * n - moment - half(n).lean; };
            while (below + 1 < nearest + aside && past(below + 1) <= 0)
                ++below;
            const HalfPlane &one = half(below), &two = half(below + 1);
            const double part = std::clamp(-past(below) / (past(below + 1) - past(below)), 0.0, 1.0);
            table.push_back(
                entry_of({std::lerp(one.distance, two.distance, part), std::lerp(one.moment, two.moment, part), 0},
                         step * (below + part) - moment));
        }
    }
    return table;
}

} // namespace fathom
