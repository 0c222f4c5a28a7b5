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

void check(Regime (*sweep)(const Device&)) {
    Regime regime = sweep(oracle::device());
    std::printf("%s against %s\n", regime.name.c_str(), regime.parameter.c_str());
    for (const Panel& panel : regime.panels)
        check_bounds(panel);
    CHECK(!regime.boundaries.empty());
    for (const Boundary& boundary : regime.boundaries)
        check_boundary(regime, boundary);
}

} // namespace

TEST_CASE("stability: where far/near ends what floats and buffers hold", "[regimes][stability]") {
    check(far_over_near);
}

TEST_CASE("stability: where the angle of an oblique plane ends z, normals, visibility and circles",
          "[regimes][stability]") {
    check(oblique_angle);
}

TEST_CASE("stability: where an oblique plane near the camera centre ends z, normals, visibility and circles",
          "[regimes][stability]") {
    check(oblique_distance);
}

TEST_CASE("stability: where bits of depth end z, normals, visibility and circles", "[regimes][stability]") {
    check(bits_of_depth);
}

TEST_CASE("stability: where noise on depth ends normals and visibility", "[regimes][stability]") {
    check(noise_on_depth);
}

TEST_CASE("stability: where grazing surfaces end visibility of finite thickness, and nothing else",
          "[regimes][stability]") {
    check(grazing_angle);
}

TEST_CASE("stability: where the radius of ambient occlusion is too short, and too long for the frame",
          "[regimes][stability]") {
    check(radius_of_occlusion);
}

TEST_CASE("stability: where thin occluders are thinner or thicker than is assumed", "[regimes][stability]") {
    check(thin_occluders);
}

TEST_CASE("stability: where the border of the image hides what occludes", "[regimes][stability]") {
    check(border_of_the_image);
}

TEST_CASE("stability: where the focus is too near for what depth is stored in", "[regimes][stability]") {
    check(focus_distance);
}

TEST_CASE("stability: where the aperture is wider than dof draws, and an edge lies before an edge",
          "[regimes][stability]") {
    check(aperture);
}

TEST_CASE("stability: where highlights are no numbers any more", "[regimes][stability]") {
    check(highlights);
}

TEST_CASE("stability: where a pseudo-linear triangle spans too wide a range", "[regimes][stability]") {
    check(w_range);
}

TEST_CASE("stability: where the end of a hard radius is seen as a ring", "[regimes][stability]") {
    check(ring_of_a_radius);
}

TEST_CASE("stability: where a picture's filter is too wide for its depth", "[regimes][stability]") {
    check(filter_width);
}

TEST_CASE("stability: where depth is too far beside its picture", "[regimes][stability]") {
    check(depth_offset);
}

TEST_CASE("stability: where a moving camera and a pulled focus make results flicker", "[regimes][stability]") {
    check(motion);
}

TEST_CASE("stability: where a lens sees too far behind itself", "[regimes][stability]") {
    check(field_of_view);
}

TEST_CASE("stability: where a distortion folds within the image", "[regimes][stability]") {
    check(distortion);
}

TEST_CASE("stability: where a panorama is too near its poles", "[regimes][stability]") {
    check(latitude_of_a_panorama);
}

TEST_CASE("stability: where the radius is too long for a panorama", "[regimes][stability]") {
    check(radius_over_distance);
}

TEST_CASE("stability: what where-it-fails sweeps are the regimes tested here", "[regimes][stability]") {
    CHECK(sweeps().size() == 21);
}
