// Precision of a stored depth against brute force: neighbouring codes are listed one by one and decoded, and random
// depths are really stored and read back.

#include "catch.hpp"
#include "seen.hpp"

#include <fathom/precision.hpp>

using namespace fathom;
using namespace fathom::seen;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Both sides decode the same two codes in long double; a difference of neighbours loses up to 2³² of 2⁶⁴.
constexpr double spacing_tolerance = 0x1p-28;
// The bound is the farther of two half steps, the error one of them; where 1/z bends they differ.
constexpr double loosest_bound = 2;
// Two ways to the same plane in long double.
constexpr double attainable_tolerance = 0x1p-44;

const FrustumEdges edges{-0.4, 0.6, -0.3, 0.5};
const Eigen::Vector4d slanted{0.3, 0.2, -0.9, -2};

struct Named {
    const char* name;
    Camera camera;
    double nearest, farthest; ///< depths to try
};

Camera encoded(Encoding encoding) {
    Camera camera = camera_of(perspective(edges, {0.5, 100}));
    camera.encoding = encoding;
    camera.near_plane = 0.5;
    camera.far_plane = 100;
    camera.median = 5;
    return camera;
}

std::vector<Named> cameras() {
    const auto d3d = Convention::direct3d();
    const Projection plain = perspective(edges, {0.5, 1000}), box = orthographic({-3, 5, -2, 7}, {0.5, 100});
    return {{"perspective", camera_of(plain), 0.5, 1000},
            {"reversed", camera_of(perspective(edges, {0.5, 1000, DepthOrder::reversed}, d3d)), 0.5, 1000},
            {"infinite", camera_of(perspective(edges, {0.5, infinity})), 0.5, 5000},
            {"reversed infinite", camera_of(perspective(edges, {0.5, infinity, DepthOrder::reversed}, d3d)), 0.5, 1e5},
            {"oblique", camera_of(with_oblique_near_plane(plain, slanted)), 3, 1000},
            {"orthographic", camera_of(box), 0.5, 100},
            {"orthographic oblique", camera_of(with_oblique_near_plane(box, slanted)), 6, 90},
            {"linear", encoded(Encoding::linear), 0.5, 100},
            {"logarithmic", encoded(Encoding::logarithmic), 0.01, 100},
            {"exponential", encoded(Encoding::exponential), 0.5, 100},
            {"median", encoded(Encoding::median), 0.1, 5000}};
}

constexpr DepthBits all_bits[] = {DepthBits::d16, DepthBits::d24, DepthBits::d32f};
const char* name_of(DepthBits bits) {
    return bits == DepthBits::d16 ? "D16" : bits == DepthBits::d24 ? "D24" : "D32F";
}

// The stored values around a depth, found by walking from the rounded one.
struct Pair {
    double below, above;
};
Pair around(DepthBits bits, Real exact) {
    if (bits != DepthBits::d32f) {
        const double last = storage_max(storage_of(bits));
        double code = 0; // by bisection over the codes, the hard way
        for (double step = 0x1p23; step >= 1; step /= 2)
            if (code + step <= last && code + step <= exact)
                code += step;
        return code == last ? Pair{last - 1, last} : Pair{code, code + 1};
    }
    float value = static_cast<float>(exact);
    while (value > exact)
        value = std::nextafter(value, -1.0f);
    while (std::nextafter(value, 2.0f) <= exact)
        value = std::nextafter(value, 2.0f);
    return value == 1 ? Pair{std::nextafter(1.0f, 0.0f), 1} : Pair{value, std::nextafter(value, 2.0f)};
}

} // namespace

TEST_CASE("precision: spacing is the distance between the two neighbouring codes", "[precision]") {
    double worst = 0;
    for (const Named& each : cameras())
        for (const DepthBits bits : all_bits) {
            const Storage storage = storage_of(bits);
            for (const double share : {0.0, 0.1, 0.52, 0.99}) {
                const double z = each.nearest + share * (each.farthest - each.nearest);
                for (const auto& [x, y] : {std::pair{20.5, 10.5}, std::pair{40.5, 25.5}}) {
                    const Pair codes = around(bits, stored_depth(each.camera, storage, x, y, z));
                    const Real a = view_depth(each.camera, storage, x, y, codes.below);
                    const Real b = view_depth(each.camera, storage, x, y, codes.above);
                    const bool beyond = each.camera.projection.is_perspective() && (a < 0 || b < 0);
                    const double expected = beyond ? infinity : static_cast<double>(std::abs(a - b));
                    const double spacing = depth_spacing(each.camera, bits, x, y, z);
                    INFO(each.name << ", " << name_of(bits) << ", z " << z << ": codes " << codes.below << " and "
                                   << codes.above);
                    // At the near plane the floats around 0 are nearer than long double can tell apart in z.
                    if (std::isinf(expected) || expected == 0) {
                        REQUIRE(spacing == expected);
                        continue;
                    }
                    const double error = std::abs(spacing / expected - 1);
                    worst = std::max(worst, error);
                    REQUIRE(error <= spacing_tolerance);
                }
            }
        }
    std::cout << "precision: spacing, worst relative difference to brute force " << worst << " (limit "
              << spacing_tolerance << ")\n";
}

TEST_CASE("precision: the bound holds for every depth that is stored, and is not loose", "[precision][slow]") {
    std::mt19937 random(7);
    double tightest = 0, loosest = 1; // share of the bound that the worst error of a camera reached
    for (const Named& each : cameras())
        for (const DepthBits bits : all_bits) {
            const Storage storage = storage_of(bits);
            const auto decode = [&](double code) { return view_depth(each.camera, storage, 20.5, 10.5, code); };
            double reached = 0;
            for (int i = 0; i < 2000; ++i) {
                const double share = std::uniform_real_distribution(0.0, 1.0)(random);
                const double z = each.nearest * std::pow(each.farthest / each.nearest, share);
                const Real exact = stored_depth(each.camera, storage, 20.5, 10.5, z);
                const Real stored = bits == DepthBits::d32f ? Real{static_cast<float>(exact)} : std::nearbyint(exact);
                const Real back = decode(static_cast<double>(stored));
                const double bound = depth_error_bound(each.camera, bits, 20.5, 10.5, z);
                if (std::isinf(bound))
                    continue;
                const double error = static_cast<double>(std::abs(back - z));
                INFO(each.name << ", " << name_of(bits) << ", z " << z << ": error " << error << ", bound " << bound);
                REQUIRE(error <= bound * (1 + spacing_tolerance));
                reached = std::max(reached, error / bound);
            }
            INFO(each.name << ", " << name_of(bits) << ": at most " << reached << " of the bound");
            REQUIRE(reached * loosest_bound >= 1);
            tightest = std::max(tightest, reached);
            loosest = std::min(loosest, reached);
        }
    std::cout << "precision: of 2000 stored depths a camera, the worst error reaches " << loosest << " to " << tightest
              << " of its bound\n";
}

TEST_CASE("precision: the attainable depth is where the ray leaves through the far plane", "[precision]") {
    // F = v_f M₄ − M₃ is zero on the far plane; the ray runs through the pixel's points on two other planes.
    const auto by_intersection = [](const Camera& camera, double x, double y) {
        const Projection& p = camera.projection;
        const auto far_plane = (p.clip_far() * p.matrix.row(3) - p.matrix.row(2)).eval();
        const auto inverse = p.matrix.inverse().eval();
        const Real up = (p.convention.clip_y == ClipY::up ? 1 : -1) * (1 - 2 * Real{y} / camera.height);
        const Eigen::Matrix<Real, 4, 1> from = inverse.col(2),
                                        to = inverse * Eigen::Matrix<Real, 4, 1>(2 * Real{x} / camera.width - 1, up,
                                                                                 p.clip_near(), 1);
        const Real at_from = far_plane.dot(from), at_to = far_plane.dot(to);
        const Eigen::Matrix<Real, 4, 1> hit = from * at_to - to * at_from;
        const Real z = depth_of(camera, hit.head<3>() / hit.w());
        const bool in_front = !p.is_perspective() || (p.matrix.row(3).dot(hit) / hit.w() > 0 && z > 0);
        return in_front ? static_cast<double>(z) : infinity;
    };
    double worst = 0;
    int infinite = 0, tried = 0;
    for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed})
        for (const Convention& convention : {Convention::opengl(), Convention::direct3d(), Convention::vulkan()}) {
            const double ahead = convention.view_axes == ViewAxes::opengl ? -1 : 1;
            const Projection plain = perspective(edges, {0.5, 100, order}, convention);
            const Projection box = orthographic({-3, 5, -2, 7}, {0.5, 100, order}, convention);
            for (const Projection& p : {plain, box, with_oblique_near_plane(plain, {0.05, -0.02, ahead, -3}),
                                        with_oblique_near_plane(plain, {0.5, 0.2, ahead, -3}),
                                        with_oblique_near_plane(plain, {2, 1, ahead, -3}),
                                        with_oblique_near_plane(box, {0.5, 0.2, ahead, -3})}) {
                const Camera camera = camera_of(p);
                for (const double x : {0.5, 17.5, 63.5})
                    for (const double y : {0.5, 31.5}) {
                        const double expected = by_intersection(camera, x, y), z = attainable_depth(camera, x, y);
                        INFO("pixel " << x << ", " << y << ": " << z << ", expected " << expected << "\n" << p.matrix);
                        ++tried;
                        if (std::isinf(expected)) {
                            ++infinite;
                            REQUIRE(z == infinity);
                            continue;
                        }
                        worst = std::max(worst, std::abs(z / expected - 1));
                        REQUIRE(std::abs(z / expected - 1) <= attainable_tolerance);
                    }
            }
        }
    REQUIRE(infinite > 0);
    REQUIRE(infinite < tried / 2);
    std::cout << "precision: attainable depth of " << tried << " rays (" << infinite
              << " never end), worst relative difference to the intersection " << worst << "\n";

    REQUIRE(attainable_depth(camera_of(perspective(edges, {0.5, infinity})), 3, 4) == infinity);
    REQUIRE(attainable_depth(encoded(Encoding::linear), 3, 4) == Approx(100));
    REQUIRE(attainable_depth(encoded(Encoding::logarithmic), 3, 4) == Approx(100));
    REQUIRE(attainable_depth(encoded(Encoding::median), 3, 4) == infinity);
    REQUIRE(attainable_depth(encoded(Encoding::view_z), 3, 4) == infinity);
    REQUIRE(attainable_depth(encoded(Encoding::inverse), 3, 4) == infinity);
}

TEST_CASE("precision: a depth range turned round changes nothing", "[precision]") {
    Camera camera = camera_of(perspective(edges, {0.5, 100}));
    const double spacing = depth_spacing(camera, DepthBits::d24, 3, 4, 20), far = attainable_depth(camera, 3, 4);
    camera.depth_range = {1, 0};
    REQUIRE(depth_spacing(camera, DepthBits::d24, 3, 4, 20) == Approx(spacing));
    REQUIRE(attainable_depth(camera, 3, 4) == Approx(far));
    camera.depth_range = {0, 0.5};
    REQUIRE(depth_spacing(camera, DepthBits::d24, 3, 4, 20) == Approx(2 * spacing));
}

TEST_CASE("precision: the pseudo-linear bound wants depths in order", "[precision]") {
    REQUIRE(pseudo_linear_bound(1, 4) == Approx(1));
    REQUIRE(pseudo_linear_bound(3, 3) == 0);
    for (const auto& [a, b] : {std::pair{0.0, 1.0}, {2.0, 1.0}, {1.0, infinity}, {-1.0, 1.0}})
        REQUIRE(contains(refusal([&, a = a, b = b] { pseudo_linear_bound(a, b); }), "0 < nearest <= farthest"));
}
