// The curves that docs/charts draws for docs/research.md, against the articles' own formulas, in their own signs
// and axes.
//   Lengyel 2005    eq. 9, 15, 19 and Figure 5
//   Kooima 2013     his normalised depths (eq5, eq7 and eq9 of the page)
//   Goldberg 2014   the derivatives of depth on the screen

#include "catch.hpp"

#include "articles/curves.hpp"
#include "articles/rasteriser.hpp"

#include <fathom/precision.hpp>

using namespace fathom;
using namespace fathom::charts;

namespace {

using Real = long double;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double same = 0x1p-44; // two derivations in double, of values up to 1

using Four = std::array<Real, 4>;

Real dot(const Four& a, const Four& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

// Lengyel's numbers for a plane turned about the y axis, n = 1, edges l, r, b, t on the near plane.
struct Figure5 {
    Four c;   // the plane
    Real a;   // eq. 9 with the corner of eq. 15
    Real end; // eq. 19 for V = (0, 0, −1, 0)
};

Figure5 lengyel(double degrees, double distance, double far) {
    const Eigen::Vector4d plane = turned_plane(degrees, distance); // the doubles that the library is given
    const Four c{plane.x(), plane.y(), plane.z(), plane.w()};
    const auto sgn = [](Real value) { return static_cast<Real>((value > 0) - (value < 0)); };
    const Real l = figure_5_edges.left, r = figure_5_edges.right, b = figure_5_edges.bottom, t = figure_5_edges.top;
    const Four q{sgn(c[0]) * (r - l) / 2 + (r + l) / 2, sgn(c[1]) * (t - b) / 2 + (t + b) / 2, -1,
                 1 / static_cast<Real>(far)};
    const Four m4{0, 0, -1, 0}, v{0, 0, -1, 0};
    const Real a = 2 * dot(m4, q) / dot(c, q);
    return {c, a, -(a * dot(c, v) + v[2]) / v[2]};
}

} // namespace

TEST_CASE("Lengyel: Figure 5 is eq. 19, clamped where a C_z <= -2", "[articles]") {
    double worst = 0;
    int clamped = 0, below = 0;
    for (const double far : {figure_5_far, 40.0, infinity})
        for (double degrees = 0; degrees <= 88; degrees += 2)
            for (const double part : {0.001, 0.05, 0.1, 0.25, 0.4, 0.6, 0.9}) {
                const double distance = part * (far == infinity ? 1 : far);
                if (far != infinity && !leaves_something(degrees, part))
                    continue;
                INFO(degrees << " degrees, distance " << distance << ", far " << far);
                const Figure5 his = lengyel(degrees, distance, far);
                const double ours = depth_at_infinity(degrees, distance, far);
                worst = std::max(worst, static_cast<double>(std::abs(ours - his.end)) / std::max(1.0, std::abs(ours)));
                REQUIRE(std::abs(ours - his.end) <= same * std::max(1.0, std::abs(ours)));

                // Less than 1 exactly where a C_z > −2, and there the axis never meets the far plane.
                const Real condition = his.a * his.c[2] + 2;
                if (std::abs(condition) < same)
                    continue;
                Camera camera;
                camera.projection = with_turned_plane(degrees, distance, far);
                camera.width = camera.height = 2;
                const double reached = attainable_depth(camera, 1, 1);
                REQUIRE((ours < 1) == (condition > 0));
                REQUIRE(std::isinf(reached) == (condition > 0));
                (condition > 0 ? below : clamped) += 1;
                // The far plane never enters the volume then, he says; but it does at the corner Q.
                if (condition > 0)
                    REQUIRE((std::isinf(far) || std::abs(attainable_depth(camera, 2, 2) / far - 1) <= 1e-9));
            }
    REQUIRE(depth_at_infinity(30, 0.1) == Approx(0.705).margin(1e-3)); // the example of docs/research.md
    REQUIRE(depth_at_infinity(60, 0.1) == Approx(0.200).margin(1e-3));
    REQUIRE(clamped > 50);
    REQUIRE(below > 300);
    std::cout << "Figure 5: " << below << " places below 1, " << clamped << " clamped, worst difference " << worst
              << "\n";
}

TEST_CASE("Lengyel: more of the range is left for a plane farther away, less for one turned farther", "[articles]") {
    // His text says that precision falls with the distance. His eq. 19 says the opposite, and so do spacings.
    const auto spacing = [](double degrees, double distance) {
        Camera camera;
        camera.projection = with_turned_plane(degrees, distance);
        camera.width = camera.height = 2;
        return depth_spacing(camera, DepthBits::d24, 1, 1, 0.9);
    };
    for (const double degrees : {20.0, 40.0, 60.0}) {
        double last = -1, last_spacing = infinity;
        for (const double distance : {0.01, 0.05, 0.1, 0.2, 0.4}) {
            INFO(degrees << " degrees, distance " << distance);
            const double ours = depth_at_infinity(degrees, distance), step = spacing(degrees, distance);
            REQUIRE(ours > last);
            REQUIRE(lengyel(degrees, distance, figure_5_far).end > last);
            REQUIRE(step < last_spacing);
            last = ours;
            last_spacing = step;
        }
        // The angle, with the plane turned about the point at a tenth of far on the axis: here he is right.
        const auto turned_about = [](double angle) { return 0.1 * std::cos(angle * std::numbers::pi / 180); };
        const double farther = degrees + 10;
        REQUIRE(depth_at_infinity(degrees, turned_about(degrees)) > depth_at_infinity(farther, turned_about(farther)));
        REQUIRE(spacing(degrees, turned_about(degrees)) < spacing(farther, turned_about(farther)));
        // Without a far plane the distance does not matter at all.
        REQUIRE(std::abs(depth_at_infinity(degrees, 0.1, infinity) - depth_at_infinity(degrees, 30, infinity)) <= same);
    }
}

TEST_CASE("Kooima: the curves of his figures", "[articles]") {
    const Real n = 1, f = 10;
    for (double z = 0.01; z < 1e4; z *= 1.05) {
        const Real e = -static_cast<Real>(z); // z_e is negative ahead
        REQUIRE(std::abs(standard_depth(1, 10, z) - (e * (f + n) + 2 * f * n) / (e * (f - n))) <= same / z + same);
        REQUIRE(std::abs(standard_depth(1, infinity, z) - (e + 2 * n) / e) <= same / z + same);
        for (const double median : {1.0, 2.0, 3.0, 4.0}) {
            const Real m = median;
            REQUIRE(std::abs(median_depth(median, z) - (-e - m) / (-e + m)) <= same);
        }
    }
    for (const double median : {1.0, 2.0, 3.0, 4.0}) {
        REQUIRE(std::abs(median_depth(median, median)) <= same);
        REQUIRE(median_depth(median, 0) == -1);
    }
    REQUIRE(std::abs(standard_depth(1, infinity, 2)) <= same); // half the range at twice the near distance
}

TEST_CASE("Goldberg: derivatives are constant for z/w, smooth for linear depth, one a triangle for z w", "[articles]") {
    const Screen screen = slanted_screen(96, 72);
    const auto triangles = slanted_plane(screen);
    const double a = slanted_inverse_depth[0], b = slanted_inverse_depth[1], c = slanted_inverse_depth[2];
    const double width = screen.width, height = screen.height, n = screen.near_plane, f = screen.far_plane;
    const auto inverse = [&](double x, double y) { return a * x / width + b * y / height + c; };

    // z/w: A/z + B with A = −f n/(f − n), and 1/z is affine on the whole plane.
    const DepthPicture usual = rasterise(triangles, screen, DepthWriter::z_over_w);
    const double gain = -f * n / (f - n);
    double worst_usual = 0, worst_linear = 0, worst_pseudo = 0;
    const DepthPicture linear = rasterise(triangles, screen, DepthWriter::linear);
    std::size_t at = 0;
    double least_second = infinity, greatest_second = 0;
    for (int row = 0; row < screen.height; ++row)
        for (int column = 0; column < screen.width; ++column, ++at) {
            REQUIRE(usual.triangle[at] >= 0);
            const double x = column + 0.5, y = row + 0.5;
            worst_usual = std::max(
                {worst_usual, std::abs(usual.dx[at] - gain * a / width), std::abs(usual.dy[at] - gain * b / height)});
            const double z = 1 / inverse(x, y), right = 1 / inverse(x + 1, y), below = 1 / inverse(x, y + 1);
            worst_linear = std::max({worst_linear, std::abs(linear.dx[at] - (right - z) / (f - n)),
                                     std::abs(linear.dy[at] - (below - z) / (f - n))});
            // Is the second derivative of linear depth constant? He wonders. It is 2 a² z³, so it is not.
            const double second = 1 / inverse(x + 1, y) - 2 * z + 1 / inverse(x - 1, y);
            least_second = std::min(least_second, second);
            greatest_second = std::max(greatest_second, second);
        }
    REQUIRE(worst_usual <= same);
    REQUIRE(worst_linear <= same);
    REQUIRE(greatest_second > 50 * least_second);

    // z w: through a triangle's corners goes one plane over the screen, solved here by Cramer's rule.
    const DepthPicture pseudo = rasterise(triangles, screen, DepthWriter::z_times_w);
    std::vector<std::array<double, 2>> slopes;
    for (const Triangle& triangle : triangles) {
        double x[3], y[3], d[3];
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d& p = triangle[i];
            x[i] = (p.x() / -p.z() / 0.5 + 1) / 2 * width;
            y[i] = (1 - p.y() / -p.z() / (0.5 * height / width)) / 2 * height;
            d[i] = (-p.z() - n) / (f - n);
        }
        const double determinant = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
        slopes.push_back({((d[1] - d[0]) * (y[2] - y[0]) - (d[2] - d[0]) * (y[1] - y[0])) / determinant,
                          ((x[1] - x[0]) * (d[2] - d[0]) - (x[2] - x[0]) * (d[1] - d[0])) / determinant});
    }
    double least = infinity, greatest = 0;
    for (std::size_t i = 0; i < pseudo.dx.size(); ++i) {
        const auto& [dx, dy] = slopes[static_cast<std::size_t>(pseudo.triangle[i])];
        worst_pseudo = std::max({worst_pseudo, std::abs(pseudo.dx[i] - dx), std::abs(pseudo.dy[i] - dy)});
        least = std::min(least, std::abs(pseudo.dy[i]));
        greatest = std::max(greatest, std::abs(pseudo.dy[i]));
    }
    REQUIRE(worst_pseudo <= same);
    REQUIRE(greatest > 3 * least);
    std::vector<std::array<double, 2>> different = slopes;
    std::sort(different.begin(), different.end());
    for (std::size_t i = 1; i < different.size(); ++i) // no two triangles of the one plane agree
        REQUIRE(different[i][0] - different[i - 1][0] > 1e-6);
    std::cout << "Goldberg: derivatives off by " << worst_usual << " (z/w), " << worst_linear << " (linear), "
              << worst_pseudo << " (z w); z w steps from " << least << " to " << greatest << " a row\n";
}

TEST_CASE("Goldberg: his fraction is what the rasteriser makes of z w", "[articles]") {
    // (t Z₁W₁ + (1 − t) Z₂W₂) / (t W₁ + (1 − t) W₂), t running along the edge in space.
    const Screen screen = slanted_screen(64, 64);
    const Triangle triangle{Eigen::Vector3d(-0.8, 0.3, -2), {3, 1, -9}, {0, -2, -5}};
    const ScreenTriangle drawn(triangle, screen, DepthWriter::z_times_w);
    const ScreenTriangle truth(triangle, screen, DepthWriter::linear);
    const double z1 = 2, z2 = 9, n = screen.near_plane, f = screen.far_plane;
    const auto stored = [&](double z) { return (z - n) / (f - n); };
    for (const double t : {0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0}) {
        const Eigen::Vector3d point = t * triangle[0] + (1 - t) * triangle[1];
        const double x = (point.x() / -point.z() / 0.5 + 1) / 2 * screen.width;
        const double y = (1 - point.y() / -point.z() / 0.5) / 2 * screen.height;
        const double his = (t * stored(z1) * z1 + (1 - t) * stored(z2) * z2) / (t * z1 + (1 - t) * z2);
        REQUIRE(std::abs(drawn.depth(x, y) - his) <= same);
        REQUIRE(std::abs(truth.depth(x, y) - stored(t * z1 + (1 - t) * z2)) <= same);
        const bool vertex = t == 0 || t == 1;
        REQUIRE((std::abs(his - stored(t * z1 + (1 - t) * z2)) <= same) == vertex);
    }
    // W₁ = W₂: the other case in which it cancels.
    const Triangle facing{Eigen::Vector3d(-1, 0, -4), {1, 0, -4}, {0, 1, -4}};
    for (const double x : {20.0, 32.0, 40.0})
        REQUIRE(std::abs(ScreenTriangle(facing, screen, DepthWriter::z_times_w).depth(x, 30) - stored(4)) <= same);
}
