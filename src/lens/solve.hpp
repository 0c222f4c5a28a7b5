#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace fathom::lens {

/// A value with its derivatives by x and by y, and the mixed one by both: what a bicubic patch has at a node. Formulas that are
/// written for any number give all of them.
struct Jet {
    double value = 0, x = 0, y = 0, xy = 0;

    Jet() = default;
    Jet(double constant) : value(constant) {}
    Jet(double its, double by_x, double by_y, double by_xy) : value(its), x(by_x), y(by_y), xy(by_xy) {}

    bool is_constant() const { return x == 0 && y == 0 && xy == 0; }

    /// f of it, with f' and f'' at its value.
    Jet through(double f, double slope, double bend) const {
        return {f, slope * x, slope * y, slope * xy + bend * x * y};
    }

    friend Jet operator+(const Jet& a, const Jet& b) { return {a.value + b.value, a.x + b.x, a.y + b.y, a.xy + b.xy}; }
    friend Jet operator-(const Jet& a, const Jet& b) { return {a.value - b.value, a.x - b.x, a.y - b.y, a.xy - b.xy}; }
    friend Jet operator*(const Jet& a, const Jet& b) {
        return {a.value * b.value, a.value * b.x + a.x * b.value, a.value * b.y + a.y * b.value,
                a.value * b.xy + a.x * b.y + a.y * b.x + a.xy * b.value};
    }
    // A constant has no derivatives.
    friend Jet operator+(double a, const Jet& b) { return {a + b.value, b.x, b.y, b.xy}; }
    friend Jet operator-(double a, const Jet& b) { return {a - b.value, -b.x, -b.y, -b.xy}; }
    friend Jet operator*(double a, const Jet& b) { return {a * b.value, a * b.x, a * b.y, a * b.xy}; }
    friend Jet operator*(const Jet& a, double b) { return b * a; }
    friend Jet operator/(const Jet& a, const Jet& b) {
        const double inverse = 1 / b.value;
        return a * b.through(inverse, -inverse * inverse, 2 * inverse * inverse * inverse);
    }
};

inline Jet sqrt(const Jet& a) {
    const double root = std::sqrt(a.value);
    return a.through(root, 0.5 / root, -0.25 / (root * a.value));
}
inline Jet sin(const Jet& a) {
    const double sine = std::sin(a.value), cosine = std::cos(a.value);
    return a.through(sine, cosine, -sine);
}
inline Jet cos(const Jet& a) {
    const double sine = std::sin(a.value), cosine = std::cos(a.value);
    return a.through(cosine, -sine, -cosine);
}
inline Jet tan(const Jet& a) {
    return sin(a) / cos(a);
}

/// How far a curve rises from 0 at 0, and how steeply it begins to.
struct Rise {
    double end = 0, value = 0, slope = 0;

    Rise() = default;
    Rise(const auto& curve, double its) : end(its), value(curve(Jet(its)).value), slope(curve(Jet(0, 1, 0, 0)).x) {}
};

/// Where a curve that rises takes this value: Newton's steps, and halves of the bracket wherever one would leave it. None beyond the
/// end. `curve` takes a Jet.
template <typename Curve>
std::optional<double> place_of(const Curve& curve, double value, const Rise& rise) {
    if (!(value >= 0) || rise.value < value)
        return std::nullopt;
    double low = 0, high = rise.end, at = std::min(value / rise.slope, rise.end);
    for (int i = 0; i < 100; ++i) { // halves alone would take 64
        const Jet here = curve(Jet(at, 1, 0, 0));
        (here.value < value ? low : high) = at;
        const double step = at - (here.value - value) / here.x;
        const double next = step >= low && step <= high ? step : low + (high - low) / 2;
        if (std::abs(next - at) <= 0x1p-52 * at || here.value == value)
            return next;
        at = next;
    }
    return at;
}

/// The derivatives of such a place, of which the value is known. Each step gives one order more.
template <typename Curve>
Jet with_derivatives(const Curve& curve, double place, const Jet& value) {
    if (value.is_constant())
        return place;
    const double slope = curve(Jet(place, 1, 0, 0)).x;
    Jet at = place;
    for (int order = 0; order < 2; ++order)
        at = at - (curve(at) - value) * Jet(1 / slope);
    at.value = place;
    return at;
}

template <typename Number>
using Two = std::array<Number, 2>;

/// A point's image under a map of the plane, and the matrix of its derivatives.
template <typename Map>
struct Linear {
    Two<Jet> image;

    Linear(const Map& map, const Two<double>& at) : image(map(Jet(at[0], 1, 0, 0), Jet(at[1], 0, 1, 0))) {}

    double determinant() const { return image[0].x * image[1].y - image[0].y * image[1].x; }

    /// What moves the image by this.
    template <typename Number>
    Two<Number> step(const Number& across, const Number& down) const {
        const Number scale = 1 / determinant();
        return {(Number(image[1].y) * across - Number(image[0].y) * down) * scale,
                (Number(image[0].x) * down - Number(image[1].x) * across) * scale};
    }
};

/// Where a map of the plane takes this value, near a place: Newton's steps. Each leaves less than a quarter of what the map is
/// off by, also on the way to a fold, and more where it leaps over one. None then, or where the map has turned over.
template <typename Map>
std::optional<Two<double>> place_beside(const Map& map, const Two<double>& value, Two<double> at) {
    const double size = std::hypot(value[0], value[1]), good = 1e-12 * std::max(size, 1.0);
    double last = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 100; ++i) { // halves alone would take 53
        const Linear<Map> here(map, at);
        const double across = here.image[0].value - value[0], down = here.image[1].value - value[1],
                     left = std::hypot(across, down);
        if (!(here.determinant() > 0) || !(left <= std::max(last / 4, good)))
            return std::nullopt;
        if (left <= 0x1p-52 * size || !(left < last))
            return at;
        last = left;
        const Two<double> step = here.step(across, down);
        at = {at[0] - step[0], at[1] - step[1]};
    }
    return at;
}

/// The same for a map that leaves 0 in its place, along the straight line from there to the value. None where the map turns over
/// on the way.
template <typename Map>
std::optional<Two<double>> place_from_middle(const Map& map, const Two<double>& value) {
    constexpr double shortest = 1.0 / 512;
    Two<double> at{0, 0};
    for (double done = 0, part = 1; done < 1;) {
        const double next = std::min(done + part, 1.0);
        const auto found = place_beside(map, {next * value[0], next * value[1]}, at);
        if (found) {
            at = *found;
            done = next;
        } else if ((part /= 2) < shortest) {
            return std::nullopt;
        }
    }
    return at;
}

/// The derivatives of such a place.
template <typename Map>
Two<Jet> with_derivatives(const Map& map, const Two<double>& place, const Two<Jet>& value) {
    if (value[0].is_constant() && value[1].is_constant())
        return {place[0], place[1]};
    const Linear<Map> here(map, place);
    Two<Jet> at{place[0], place[1]};
    for (int order = 0; order < 2; ++order) {
        const Two<Jet> image = map(at[0], at[1]), step = here.step(image[0] - value[0], image[1] - value[1]);
        at = {at[0] - step[0], at[1] - step[1]};
    }
    at[0].value = place[0];
    at[1].value = place[1];
    return at;
}

} // namespace fathom::lens
