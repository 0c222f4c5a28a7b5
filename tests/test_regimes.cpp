// The boundaries that bench/regimes states, on both sides: up to where one says a method's error stays within the
// limit, and beyond it does not. Everywhere no error exceeds the bound that its arithmetic allows.

#include "catch.hpp"
#include "judge.hpp"
#include "regimes/regime.hpp"

using namespace fathom;
using namespace fathom::regimes;

namespace {

// A bound that no curve's error comes near says nothing.
constexpr double nearest_to_bound = 0.04;

/// The largest error of a curve over its bound; 0 where it has none.
double share_of_bound(const Panel& panel, const Curve& curve) {
    double share = 0;
    for (const Point& point : curve.points) {
        if (!std::isfinite(point.bound))
            continue;
        INFO(panel.quantity << ", " << curve.name << ", at " << point.parameter);
        CHECK(point.error <= point.bound);
        share = std::max(share, point.error / point.bound);
    }
    return share;
}

void check_bounds(const Panel& panel) {
    double largest = 0;
    bool bounded = false;
    for (const Curve& curve : panel.curves) {
        const double share = share_of_bound(panel, curve);
        if (share > 0)
            std::printf("  %s, %s: at most %.3f of its bound\n", panel.quantity.c_str(), curve.name.c_str(), share);
        bounded |= std::ranges::any_of(curve.points, [](const Point& point) { return std::isfinite(point.bound); });
        largest = std::max(largest, share);
    }
    INFO(panel.quantity);
    CHECK((largest >= nearest_to_bound || !bounded));
}

/// Does a parameter lie from one end on, in the direction of the other, or between the two?
bool lies(double parameter, double end, double other_end, bool upwards) {
    const bool beyond = upwards ? parameter >= end : parameter <= end;
    return beyond && (std::isnan(other_end) || (upwards ? parameter <= other_end : parameter >= other_end));
}

void check_boundary(Regime& regime, const Boundary& boundary) {
    const bool everywhere = std::isnan(boundary.breaks), upwards = everywhere || boundary.breaks > boundary.holds;
    double inside = 0, outside = INFINITY;
    int points_inside = 0, points_outside = 0;
    INFO(boundary.quantity << ", " << boundary.curve);
    for (const Point& point : regime.panel(boundary.quantity).curve(boundary.curve).points) {
        INFO("at " << point.parameter);
        if (everywhere || lies(point.parameter, boundary.holds, boundary.holds_from, !upwards)) {
            CHECK(point.error <= boundary.limit);
            inside = std::max(inside, point.error);
            ++points_inside;
        } else if (lies(point.parameter, boundary.breaks, boundary.breaks_to, upwards)) {
            CHECK(point.error > boundary.limit);
            outside = std::min(outside, point.error);
            ++points_outside;
        }
    }
    std::printf("  %s, %s: limit %.3g; to %g at most %.3g", boundary.quantity.c_str(), boundary.curve.c_str(),
                boundary.limit, boundary.holds, inside);
    std::printf(everywhere ? ", everywhere\n" : "; from %g at least %.3g\n", boundary.breaks, outside);
    CHECK(points_inside >= 1);
    CHECK((points_outside >= 1 || everywhere));
}

void check(Regime regime) {
    std::printf("%s against %s\n", regime.name.c_str(), regime.parameter.c_str());
    for (const Panel& panel : regime.panels)
        check_bounds(panel);
    CHECK(!regime.boundaries.empty());
    for (const Boundary& boundary : regime.boundaries)
        check_boundary(regime, boundary);
}

} // namespace

TEST_CASE("stability: every regime of where-it-fails ends where its boundaries say", "[regimes][stability]") {
    for (const Sweep& sweep : sweeps()) {
        INFO(sweep.name);
        check(sweep.run(oracle::device()));
    }
}
