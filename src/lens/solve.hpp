#pragma once

#include "lens/jet.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

namespace fathom::lens {

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

/// Where a map of the plane takes this value, from a first guess: Newton's steps, halved until the residual falls. None where the
/// map turns over on the way, or where the residual stays.
template <typename Map>
std::optional<Two<double>> place_of(const Map& map, const Two<double>& value, Two<double> at) {
    constexpr double good = 1e-12;
    const auto residual = [&](const Linear<Map>& here) {
        return std::hypot(here.image[0].value - value[0], here.image[1].value - value[1]);
    };
    double left = std::numeric_limits<double>::infinity();
    Linear<Map> here(map, at);
    for (int i = 0; i < 50; ++i) {
        if (!(here.determinant() > 0))
            return std::nullopt;
        left = residual(here);
        if (left <= 0x1p-52 * std::hypot(value[0], value[1]))
            break;
        const Two<double> step = here.step(here.image[0].value - value[0], here.image[1].value - value[1]);
        double share = 1;
        const auto moved = [&] { return Two<double>{at[0] - share * step[0], at[1] - share * step[1]}; };
        Linear<Map> next(map, moved());
        while (share > 1e-4 && !(residual(next) < left)) {
            share /= 2;
            next = Linear<Map>(map, moved());
        }
        if (share <= 1e-4) // as near as doubles come, or stuck
            break;
        at = moved();
        here = next;
    }
    return left <= good ? std::optional(at) : std::nullopt;
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
