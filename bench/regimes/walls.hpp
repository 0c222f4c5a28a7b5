#pragma once

// A floor beside an infinite upright wall that is higher than the radius.

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fathom::regimes {

/// V = 1 - (a - sin a cos a)/pi, where the radius reaches the wall at the angle a from its foot's direction: cos a is the
/// distance from the wall in radii.
inline double beside_wall(double radii) {
    const double a = std::acos(std::min(radii, 1.0));
    return 1 - (a - std::sin(a) * std::cos(a)) / std::numbers::pi;
}

} // namespace fathom::regimes
