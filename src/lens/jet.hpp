#pragma once

#include <cmath>

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

inline double value_of(double a) {
    return a;
}
inline double value_of(const Jet& a) {
    return a.value;
}

} // namespace fathom::lens
