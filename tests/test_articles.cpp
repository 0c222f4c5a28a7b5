// The articles' own results. Their constants and claims are written here from the elements of the projection matrix,
// p(row, column) counted from zero, and compared with what the library derives by inverting it.
//   Popov 2016     An Efficient Depth Linearization Method for Oblique View Frustums, JCGT 5(4)
//   Lengyel 2005   Oblique View Frustum Depth Projection and Clipping, Journal of Game Development 1(2)
//   Kooima 2013    Median Distance Perspective Projection
//   Goldberg 2014  on z·w as linear depth (yosoygames.com.ar)
//   Lenaerts 2014  Reconstructing positions from the depth buffer, part 2

#include "catch.hpp"
#include "seen.hpp"

#include "camera/rays.hpp"
#include "operations/parameters.hpp"

#include <fathom/linearize.hpp>
#include <fathom/precision.hpp>

using namespace fathom;
using namespace fathom::seen;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Two derivations of the same constants, a few dozen roundings of 2⁻⁶⁴ each.
constexpr Real constants_tolerance = 0x1p-56L;
// A point of a plane given in doubles lies on it to 2⁻⁵³ of its terms.
constexpr Real on_plane_tolerance = 0x1p-48L;
// Long double positions through an inverse, relative to the distance.
constexpr Real position_tolerance = 0x1p-54L;

const FrustumEdges centred{-0.5, 0.5, -0.375, 0.375}, off_centre{-0.375, 0.625, -0.25, 0.5};

Point unit(Real x, Real y, Real z) {
    return Point(x, y, z).normalized();
}

Eigen::Vector4d plane_of(ViewAxes axes, const Point& normal, double offset) {
    const Point n = turned(axes, normal);
    return {static_cast<double>(n.x()), static_cast<double>(n.y()), static_cast<double>(n.z()), offset};
}

struct Kind {
    std::string name;
    Projection projection;
};

// Every convention that the oblique near plane is used with.
std::vector<Kind> kinds() {
    std::vector<Kind> all;
    const Convention zero_to_one{ClipZ::zero_to_one, ClipY::up, ViewAxes::opengl};
    for (const auto& [name, convention] : {std::pair{"OpenGL", Convention::opengl()},
                                           {"Direct3D", Convention::direct3d()},
                                           {"Vulkan", Convention::vulkan()},
                                           {"0..1", zero_to_one}})
        for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed}) {
            const std::string is = std::string(name) + (order == DepthOrder::reversed ? " reversed" : "");
            all.push_back({is, perspective(centred, {0.5, 100, order}, convention)});
            all.push_back({is + " off-centre", perspective(off_centre, {0.5, 100, order}, convention)});
            all.push_back({is + " infinite", perspective(off_centre, {0.5, infinity, order}, convention)});
            all.push_back({is + " orthographic", orthographic({-9, 12, -7, 8}, {0.5, 100, order}, convention)});
        }
    return all;
}

Real clip_value(const Projection& p, const Eigen::Matrix<Real, 4, 1>& point) {
    return p.matrix.row(2).dot(point) / p.matrix.row(3).dot(point);
}

// The four corners of the far end, as homogeneous points with w_clip = 1.
std::array<Eigen::Matrix<Real, 4, 1>, 4> far_corners(const Projection& p) {
    const Projection::Matrix inverse = p.matrix.inverse();
    std::array<Eigen::Matrix<Real, 4, 1>, 4> corners;
    for (std::size_t i = 0; i < 4; ++i)
        corners[i] = inverse * Eigen::Matrix<Real, 4, 1>(i % 2 ? 1 : -1, i / 2 ? 1 : -1, p.clip_far(), 1);
    return corners;
}

// Our constants, said in normalised device coordinates of an OpenGL image with its first row on top.
Affine in_clip_coordinates(const Affine& ours, const Camera& camera) {
    const Real v = ours[0] / 2, x = ours[1] * camera.width / 2, y = ours[2] * camera.height / 2;
    return {v, x, -y, v + x + y + ours[3]};
}

Real difference(const Affine& a, const Affine& b) {
    Real worst = 0, size = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        worst = std::max(worst, std::abs(a[i] - b[i]));
        size = std::max(size, std::abs(a[i]));
    }
    return worst / size;
}

} // namespace

TEST_CASE("Popov: our constants are his, symbol by symbol", "[articles]") {
    const Eigen::Vector4d slanted{0.3, 0.2, -0.9, -2};
    const Projection plain = perspective(centred, {0.5, 100}), aside = perspective(off_centre, {0.5, 100});
    const Projection infinite = perspective(off_centre, {0.5, infinity}),
                     box = orthographic({-9, 12, -7, 8}, {0.5, 100});
    Real worst = 0;
    const auto compare = [&](const char* kind, const Affine& ours, const Affine& his) {
        INFO(kind << ": ours " << ours[0] << " " << ours[1] << " " << ours[2] << " " << ours[3] << ", his " << his[0]
                  << " " << his[1] << " " << his[2] << " " << his[3]);
        REQUIRE(difference(ours, his) <= constants_tolerance);
        worst = std::max(worst, difference(ours, his));
    };

    // Centred, stored depth: z = 1/(Z d + W) with Z = 1/f − 1/n and W = 1/n.
    const DepthForm form = depth_form(camera_of(plain));
    REQUIRE(form.form == Form::reciprocal);
    compare("centred, near and far", form.denominator, {1 / 100.0L - 1 / 0.5L, 0, 0, 1 / 0.5L});

    // Any perspective, of (z_ndc, x_ndc, y_ndc, 1). With w = z (the fourth row is 0 0 −1 0):
    //   1/z = [z_ndc − (p20/p00) x_ndc − (p21/p11) y_ndc + p22 − p20 p02/p00 − p21 p12/p11] / p23
    for (const auto& [kind, p] : {std::pair{"centred", plain},
                                  {"off-centre", aside},
                                  {"infinite", infinite},
                                  {"oblique", with_oblique_near_plane(plain, slanted)},
                                  {"oblique off-centre", with_oblique_near_plane(aside, slanted)},
                                  {"oblique infinite", with_oblique_near_plane(infinite, slanted)}}) {
        const auto& m = p.matrix;
        const Camera camera = camera_of(p);
        compare(kind, in_clip_coordinates(depth_form(camera).denominator, camera),
                {1 / m(2, 3), -m(2, 0) / (m(0, 0) * m(2, 3)), -m(2, 1) / (m(1, 1) * m(2, 3)),
                 (m(2, 2) - m(2, 0) * m(0, 2) / m(0, 0) - m(2, 1) * m(1, 2) / m(1, 1)) / m(2, 3)});
    }

    // Orthographic rays: z = [−z_ndc + (p20/p00) x_ndc + (p21/p11) y_ndc + p23 − p20 p03/p00 − p21 p13/p11] / p22.
    for (const auto& [kind, p] :
         {std::pair{"orthographic", box}, {"orthographic oblique", with_oblique_near_plane(box, slanted)}}) {
        const auto& m = p.matrix;
        const Camera camera = camera_of(p);
        compare(kind, in_clip_coordinates(depth_form(camera).numerator, camera),
                {-1 / m(2, 2), m(2, 0) / (m(0, 0) * m(2, 2)), m(2, 1) / (m(1, 1) * m(2, 2)),
                 (m(2, 3) - m(2, 0) * m(0, 3) / m(0, 0) - m(2, 1) * m(1, 3) / m(1, 1)) / m(2, 2)});
    }
    std::cout << "Popov: worst relative difference of a constant " << worst << " (limit " << constants_tolerance
              << ")\n";
}

TEST_CASE("Popov: what is not depth may be computed at the corners and interpolated", "[articles]") {
    // 1/z = Z d + B(x, y): B is affine in the pixel, so four corners (a full-screen quad) give it exactly.
    const Camera camera =
        camera_of(with_oblique_near_plane(perspective(off_centre, {0.5, 100}), {0.3, 0.2, -0.9, -2}), 161, 121);
    const auto& p = camera.projection.matrix;
    const auto b_of_clip = [&](Real x, Real y) { // from a vertex position in clip space, w = 1
        const Real bx = -p(2, 0) / (p(0, 0) * p(2, 3)), by = -p(2, 1) / (p(1, 1) * p(2, 3));
        return bx * (x + p(0, 2)) + by * (y + p(1, 2)) + p(2, 2) / p(2, 3);
    };
    for (const Real x : {0.5L, 40.0L, 160.5L})
        for (const Real y : {0.5L, 77.5L}) {
            const Real s = x / camera.width, t = y / camera.height;
            const Real b = (1 - t) * ((1 - s) * b_of_clip(-1, 1) + s * b_of_clip(1, 1)) +
                           t * ((1 - s) * b_of_clip(-1, -1) + s * b_of_clip(1, -1));
            for (const double d : {0.0, 0.3, 0.9}) {
                const Real z = 1 / ((2 * Real{d} - 1) / p(2, 3) + b);
                const Real ours =
                    view_depth(camera, Storage::float32, static_cast<double>(x), static_cast<double>(y), d);
                REQUIRE(std::abs(ours / z - 1) <= constants_tolerance * 64); // κ of these points is below 64
            }
        }
}

TEST_CASE("Popov: the programs of listing 1 give the depth behind a fragment, with the sign of eq. 9 turned",
          "[articles]") {
    // He draws a triangle and asks for the depth of what the buffer holds behind it, at the same pixel. The vertex
    // program hands on b = (clip · U_v, w); the fragment program says z = 1/(z_w U_f + b.x/b.y). U_v is eq. 8, which is
    // negated so that z is positive. U_f of eq. 9 is −scale/P₃₄; with a negated U_v it has to be +scale/P₃₄.
    const Convention zero_to_one{ClipZ::zero_to_one, ClipY::up, ViewAxes::opengl};
    const std::array<Point, 3> triangle{Point(-1, -1, -4), Point(2, -0.5L, -7), Point(0, 1, -5)};
    Real worst = 0;
    for (const Convention& convention : {Convention::opengl(), zero_to_one})
        for (const FrustumEdges& edges : {centred, off_centre})
            for (const bool oblique : {false, true}) {
                const Projection plain = perspective(edges, {0.5, 100}, convention);
                const Projection p = oblique ? with_oblique_near_plane(plain, {0.3, 0.2, -0.9, -2}) : plain;
                const Camera camera = camera_of(p);
                const bool gl = convention.clip_z == ClipZ::negative_one_to_one;
                const Real scale = gl ? 2 : 1;
                const auto& m = p.matrix;
                // Off-centre, "the bias should also contain additional constant components from Equation (6)".
                const Real bias = (gl ? -1 : 0) - m(2, 0) * m(0, 2) / m(0, 0) - m(2, 1) * m(1, 2) / m(1, 1);
                const Eigen::Matrix<Real, 1, 4> u_v(-m(2, 0) / (m(0, 0) * m(2, 3)), -m(2, 1) / (m(1, 1) * m(2, 3)), 0,
                                                    (m(2, 2) + bias) / m(2, 3));
                const Real u_f = scale / m(2, 3);
                for (const Point& share : {Point(0.2L, 0.3L, 0.5L), Point(0.7L, 0.1L, 0.2L), Point(0, 0.5L, 0.5L)}) {
                    // Interpolated with perspective correction: affine in space is what that amounts to.
                    Point fragment = Point::Zero();
                    Eigen::Matrix<Real, 2, 1> b(0, 0);
                    for (std::size_t i = 0; i < 3; ++i) {
                        const Real weight = share[static_cast<Eigen::Index>(i)];
                        const Eigen::Matrix<Real, 4, 1> clip = m * triangle[i].homogeneous();
                        fragment += weight * triangle[i];
                        b += weight * Eigen::Matrix<Real, 2, 1>(u_v * clip, clip.w());
                    }
                    const Point behind = 3 * fragment; // the same pixel, three times as far away
                    const Real z_w = place_of(camera, behind).stored;
                    const Real z = 1 / (z_w * u_f + b.x() / b.y()), as_printed = 1 / (-z_w * u_f + b.x() / b.y());
                    const Real truth = -behind.z();
                    INFO("clip from " << (gl ? -1 : 0) << (oblique ? ", oblique" : "") << ": " << z << " for "
                                      << truth);
                    worst = std::max(worst, std::abs(z / truth - 1));
                    REQUIRE(std::abs(z / truth - 1) <= constants_tolerance * 256); // κ of these points is below 256
                    REQUIRE(std::abs(as_printed / truth - 1) > 0.5L);
                }
            }
    std::cout << "Popov: listing 1 with eq. 8 and the turned eq. 9, worst relative error " << worst << "\n";
}

TEST_CASE("Lengyel: a near plane parallel to the old one gives the ordinary matrix back", "[articles]") {
    Real worst = 0;
    for (const Kind& kind : kinds()) {
        const Projection& p = kind.projection;
        INFO(kind.name);
        const Projection same = with_oblique_near_plane(p, plane_of(p.convention.view_axes, {0, 0, -1}, -0.5));
        const Real error = (same.matrix - p.matrix).cwiseAbs().maxCoeff() / p.matrix.cwiseAbs().maxCoeff();
        worst = std::max(worst, error);
        REQUIRE(error <= constants_tolerance);
        // Farther away: the matrix whose near distance that is.
        if (kind.name == "OpenGL off-centre") {
            const double n = 2, k = n / 0.5;
            const Projection expected = perspective(
                FrustumEdges{k * off_centre.left, k * off_centre.right, k * off_centre.bottom, k * off_centre.top},
                {n, 100});
            REQUIRE((with_oblique_near_plane(p, {0, 0, -1, -n}).matrix - expected.matrix).cwiseAbs().maxCoeff() <=
                    constants_tolerance);
        }
    }
    std::cout << "Lengyel: plane parallel to the near plane, worst relative difference of an element " << worst << "\n";
}

TEST_CASE("Lengyel: the new row is eq. 14 with the corner of eq. 15", "[articles]") {
    // For n = 0.5, f = 100 and the edges l, r, b, t; M₄ is 0 0 −1 0.
    const double n = 0.5, f = 100;
    Real worst = 0;
    for (const FrustumEdges& edges : {centred, off_centre})
        for (const double far : {f, infinity})
            for (const Eigen::Vector4d& plane :
                 {Eigen::Vector4d(0.3, 0.2, -0.9, -2), Eigen::Vector4d(-0.6, 0.1, -0.4, -3),
                  Eigen::Vector4d(0.2, -0.7, -0.7, -1), Eigen::Vector4d(0, 0, -1, -4)}) {
                const Eigen::Matrix<Real, 4, 1> c = plane.cast<Real>();
                const auto sgn = [](Real value) { return static_cast<Real>((value > 0) - (value < 0)); };
                const Real l = edges.left, r = edges.right, b = edges.bottom, t = edges.top, two_n = 2 * Real{n};
                const Eigen::Matrix<Real, 4, 1> q(sgn(c.x()) * (r - l) / two_n + (r + l) / two_n,
                                                  sgn(c.y()) * (t - b) / two_n + (t + b) / two_n, -1, 1 / Real{far});
                const Eigen::Matrix<Real, 1, 4> row =
                    -2 * q.z() / c.dot(q) * c.transpose() + Eigen::Matrix<Real, 1, 4>(0, 0, 1, 0);
                const auto ours = with_oblique_near_plane(perspective(edges, {n, far}), plane).matrix.row(2).eval();
                worst = std::max(worst, (ours - row).norm() / row.norm());
                REQUIRE((ours - row).norm() <= constants_tolerance * row.norm());
                if (c.x() == 0 && c.y() == 0 && far == f) { // eq. 16, with d = 4
                    const Real d = 4;
                    REQUIRE(std::abs(ours(2) + (f + d) / (f - d)) <= constants_tolerance * 4);
                    REQUIRE(std::abs(ours(3) + 2 * f * d / (f - d)) <= constants_tolerance * 16);
                }
            }
    std::cout << "Lengyel: eq. 14 and 15, worst relative difference of the row " << worst << "\n";
}

TEST_CASE("Lengyel: the plane becomes the near value, the far plane touches the opposite corner", "[articles]") {
    std::mt19937 random(3);
    const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
    Real worst_near = 0, worst_corner = 0, worst_line = 0;
    int planes = 0;
    for (const Kind& kind : kinds()) {
        const Projection& p = kind.projection;
        const bool has_centre = p.is_perspective();
        for (int i = 0; i < 100; ++i) {
            const Point normal = unit(uniform(-0.7, 0.7), uniform(-0.7, 0.7), -1);
            // Legal orthographic planes may have the origin on either side.
            const Eigen::Vector4d plane =
                plane_of(p.convention.view_axes, normal, has_centre ? uniform(-20, -0.6) : uniform(-20, 5));
            const Eigen::Matrix<Real, 4, 1> c = plane.cast<Real>();
            Projection oblique;
            const std::string refused = refusal([&] { oblique = with_oblique_near_plane(p, plane); });
            if (!refused.empty()) {
                INFO(kind.name << ": " << plane.transpose() << ": " << refused);
                REQUIRE(contains(refused, "leaves nothing of the view volume"));
                continue;
            }
            ++planes;
            INFO(kind.name << ", plane " << plane.transpose());
            REQUIRE((oblique.matrix.row(0) == p.matrix.row(0) && oblique.matrix.row(1) == p.matrix.row(1) &&
                     oblique.matrix.row(3) == p.matrix.row(3)));

            // Random points of the plane.
            const Point n = c.head<3>(), foot = -c.w() / n.squaredNorm() * n;
            const Point u = n.unitOrthogonal(), v = n.cross(u).normalized();
            for (int k = 0; k < 10; ++k) {
                const Point point = foot + uniform(-9, 9) * u + uniform(-9, 9) * v;
                const Eigen::Matrix<Real, 4, 1> q = point.homogeneous();
                const Real w = p.matrix.row(3).dot(q);
                const Real error = std::abs(oblique.matrix.row(2).dot(q) - p.clip_near() * w) /
                                   (oblique.matrix.row(2).cwiseAbs().dot(q.cwiseAbs().transpose()) + std::abs(w));
                worst_near = std::max(worst_near, error);
                REQUIRE(error <= on_plane_tolerance);
            }

            // The far value is reached at one far corner of the old volume, and passed at none.
            Real closest = std::numeric_limits<Real>::infinity();
            const Real along = p.clip_far() - p.clip_near();
            for (const auto& corner : far_corners(p)) {
                const Real short_of_far = (p.clip_far() - clip_value(oblique, corner)) / along;
                REQUIRE(short_of_far >= -on_plane_tolerance);
                closest = std::min(closest, std::abs(short_of_far));
            }
            worst_corner = std::max(worst_corner, closest);
            REQUIRE(closest <= on_plane_tolerance);

            // Near and far plane meet where w = 0: in the plane through the camera centre, parallel to the screen.
            if (has_centre) {
                const Point ahead = p.matrix.row(3).head<3>().transpose();
                const Point line = n.cross(ahead);
                const Eigen::Matrix<Real, 4, 1> far_plane =
                    (p.clip_far() * oblique.matrix.row(3) - oblique.matrix.row(2)).transpose();
                const Real off = std::abs(far_plane.head<3>().normalized().dot(line));
                worst_line = std::max(worst_line, off);
                REQUIRE(off <= on_plane_tolerance);
            }
        }
    }
    REQUIRE(planes > 2000);
    std::cout << "Lengyel: " << planes << " planes; near value off by at most " << worst_near << ", far corner by "
              << worst_corner << ", the line of near and far plane by " << worst_line << "\n";
}

TEST_CASE("Lengyel: the depth attainable in a direction", "[articles]") {
    // With a plane of unit normal N at distance δ from the camera centre, kept points ahead, D the ray that covers a depth
    // of one and D_Q the ray of the corner that the far plane touches:
    //   1/z_far(D) = 1/f − N·(D_Q − D)/δ          where the far plane cuts the ray; never, when that is ≤ 0
    //   v(z, D) = v_n + (v_f − v_n)(N·D − δ/z)/(N·D_Q − δ/f)      the clip value of depth z
    Real worst_far = 0, worst_value = 0;
    for (const double far : {100.0, infinity})
        for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed}) {
            const Projection plain = perspective(off_centre, {0.5, far, order});
            const Rays ray = camera_rays(camera_of(plain));
            for (const double degrees : {0.0, 10.0, 30.0, 50.0, 60.0}) {
                const Real angle = degrees * std::numbers::pi / 180;
                const Eigen::Vector4d plane(static_cast<double>(std::sin(angle)), 0,
                                            -static_cast<double>(std::cos(angle)), -2);
                const Point normal = plane.head<3>().cast<Real>();
                const Camera camera = camera_of(with_oblique_near_plane(plain, plane));
                Real corner = -infinity;
                for (const Real x : {0, 64})
                    for (const Real y : {0, 32})
                        corner = std::max(corner, normal.dot(ray.direction * Point(x, y, 1)));
                for (const double x : {0.5, 32.0, 63.5}) {
                    const Real along = normal.dot(ray.direction * Point(x, 16, 1));
                    const Real inverse = 1 / Real{far} - (corner - along) / 2;
                    const double z = attainable_depth(camera, x, 16);
                    INFO(degrees << " degrees, far " << far << ", x " << x << ": " << z << ", 1/z " << inverse);
                    if (inverse <= 0)
                        REQUIRE(z == infinity);
                    else {
                        worst_far = std::max(worst_far, std::abs(z * inverse - 1));
                        REQUIRE(std::abs(z * inverse - 1) <= on_plane_tolerance);
                        REQUIRE(z >= far * (1 - 1e-15)); // the far plane never cuts into the old volume
                    }
                    for (const double depth : {10.0, 90.0}) {
                        const Real share = (along - 2 / Real{depth}) / (corner - 2 / Real{far});
                        const Real stored = order == DepthOrder::reversed ? 1 - share : share;
                        const Real error = std::abs(stored_depth(camera, Storage::float32, x, 16, depth) - stored);
                        worst_value = std::max(worst_value, error);
                        REQUIRE(error <= on_plane_tolerance);
                    }
                }
            }
        }
    std::cout << "Lengyel: attainable depth, worst relative error " << worst_far << "; stored value " << worst_value
              << "\n";
}

TEST_CASE("Pranckevicius: the same plane cuts an orthographic volume", "[articles]") {
    const Projection box = orthographic({-9, 12, -7, 8}, {0.5, 100});
    for (const double offset : {-8.0, 0.0, 8.0}) { // the origin on either side is legal: there is no centre
        const Camera camera = camera_of(with_oblique_near_plane(box, {0.4, -0.3, -0.8, offset}));
        const DepthForm form = depth_form(camera);
        REQUIRE(form.form == Form::affine);
        const Point point(3, -2, -40);
        const Place place = place_of(camera, point);
        const Real z = view_depth(camera, Storage::float32, static_cast<double>(place.x), static_cast<double>(place.y),
                                  static_cast<double>(place.stored));
        REQUIRE(std::abs(z - 40) <= 40 * on_plane_tolerance);
    }
}

TEST_CASE("Kooima: median depth is -1 at the camera centre, 0 at the median and goes to 1", "[articles]") {
    Camera camera = camera_of(perspective(centred, {0.5, infinity}));
    camera.encoding = Encoding::median;
    camera.median = 5;
    const auto clip = [&](double z) { return 2 * stored_depth(camera, Storage::float32, 3, 4, z) - 1; };
    REQUIRE(clip(0) == -1);
    REQUIRE(std::abs(clip(5)) <= constants_tolerance);
    REQUIRE(std::abs(clip(infinity) - 1) <= constants_tolerance);
    Real last = -1;
    for (double z = 0.01; z < 1e6; z *= 1.1) {
        const Real expected = (z - 5.0L) / (z + 5.0L);
        REQUIRE(std::abs(clip(z) - expected) <= constants_tolerance);
        REQUIRE(clip(z) > last);
        REQUIRE(clip(z) < 1);
        last = clip(z);
        // As many values in front of the median as behind it, and the same for k times and 1/k times the median.
        REQUIRE(std::abs(clip(z) + clip(25 / z)) <= 0x1p-50L);
    }
    // Back: z = m (1 + z_d)/(1 − z_d).
    for (const double d : {0.0, 0.25, 0.5, 0.96875})
        REQUIRE(static_cast<double>(view_depth(camera, Storage::float32, 3, 4, d)) == Approx(5 * d / (1 - d)));
    REQUIRE(view_depth(camera, Storage::float32, 3, 4, 1) == std::numeric_limits<Real>::infinity());

    // An infinite far plane stores infinity as 1, and the ordinary curve z_d = 1 − 2n/z with it.
    const Camera infinite = camera_of(perspective(centred, {0.5, infinity}));
    REQUIRE(stored_depth(infinite, Storage::float32, 3, 4, infinity) == 1);
    REQUIRE(std::abs(2 * stored_depth(infinite, Storage::float32, 3, 4, 8) - 1 - (1 - 2 * 0.5L / 8)) <=
            constants_tolerance);
}

TEST_CASE("Kooima: his first matrix is an infinite projection, the vertex program's is the median's", "[articles]") {
    // Of eq10 the last two rows are (0 0 −1 −1) and (0 0 −1 0), as the page has them: z_d = 1 − 1/z, an infinite far plane
    // with the near plane at 1/2. The vertex program writes z = −z_e − m and w = −z_e + m, as his eq9 asks.
    const auto& half = perspective(FrustumEdges{-1, 1, -1, 1}, {0.5, infinity}).matrix;
    REQUIRE(half.row(2) == Eigen::Matrix<Real, 1, 4>(0, 0, -1, -1));
    REQUIRE(half.row(3) == Eigen::Matrix<Real, 1, 4>(0, 0, -1, 0));

    // An edge from z = 1 to z = 10, drawn by that vertex program: x_c = x (z + m)/z, w_c = z + m.
    Camera camera = camera_of(perspective(FrustumEdges{-0.5, 0.5, -0.5, 0.5}, {0.5, infinity}));
    camera.encoding = Encoding::median;
    const Point near(0.5L, 0, -1), far(-5, 0, -10);
    for (const double median : {0.5, 5.0, 50.0}) {
        camera.median = median;
        Real worst = 0;
        for (const Real t : {0.0L, 0.25L, 0.5L, 0.75L, 1.0L}) { // along the edge in space
            const auto clip = [&](const Point& p) {             // x, z, w
                const Real z = -p.z(), m = median;
                return Point(p.x() * (z + m) / z, z - m, z + m);
            };
            const Point drawn = (1 - t) * clip(near) + t * clip(far);
            const Point point = (1 - t) * near + t * far;
            // Its depth is that of the point: z − m and z + m are linear in space.
            const double stored = static_cast<double>((drawn.y() / drawn.z() + 1) / 2);
            REQUIRE(std::abs(view_depth(camera, Storage::float32, 3, 4, stored) / -point.z() - 1) <= 0x1p-44L);
            // Its place on the screen is not, but for the vertices.
            const Real off = std::abs(drawn.x() / drawn.z() - point.x() / -point.z());
            worst = std::max(worst, off);
            REQUIRE((off <= 0x1p-50L) == (t == 0 || t == 1));
        }
        std::cout << "Kooima: median " << median << ", an edge from 1 to 10 over half the screen: x off by up to "
                  << worst / 2 << " of the width\n";
        REQUIRE(worst > 0.01L);
    }
}

TEST_CASE("Goldberg: z times w is linear at vertices only, and the bound holds inside", "[articles]") {
    Camera camera = camera_of(perspective(centred, {0.5, 100}));
    camera.encoding = Encoding::pseudo_linear;
    camera.near_plane = 0.5;
    camera.far_plane = 100;
    // The vertex program's z·w divided by w is (z − n)/(f − n) at a vertex, and window-linear between vertices, while
    // 1/z is window-linear in truth. Barycentric coordinates of the window stand for the pixels.
    const auto error_at = [&](const Point& depths, const Point& weights) {
        const Real stored = ((depths.array() - 0.5L) / 99.5L).matrix().dot(weights);
        const Real decoded = view_depth(camera, Storage::float32, 3, 4, static_cast<double>(stored));
        return std::abs(decoded - 1 / depths.cwiseInverse().dot(weights));
    };
    std::mt19937 random(11);
    std::cout
        << "Goldberg: farthest/nearest vertex, worst error inside random triangles, bound, error at the geometric "
           "mean (near vertex at 1)\n";
    for (const double ratio : {1.01, 1.1, 1.5, 2.0, 5.0, 10.0, 50.0}) {
        const double bound = pseudo_linear_bound(1, ratio);
        Real worst = 0;
        for (int triangle = 0; triangle < 50; ++triangle) {
            const Real middle = std::uniform_real_distribution(1.0, ratio)(random);
            const Point depths(1, ratio, middle);
            for (int i = 0; i <= 40; ++i)
                for (int j = 0; i + j <= 40; ++j) {
                    const Point weights(i / 40.0L, j / 40.0L, (40 - i - j) / 40.0L);
                    worst = std::max(worst, error_at(depths, weights));
                }
        }
        // Where the true depth is the geometric mean of both ends: 1/√r = a + (1 − a)/r.
        const Real r = ratio, a = (1 / std::sqrt(r) - 1 / r) / (1 - 1 / r);
        const Real attained = error_at({1, r, r}, {a, 1 - a, 0});
        const Real rounding = 0x1p-50L * ratio; // the stored value is a double
        REQUIRE(worst <= bound + rounding);
        REQUIRE(worst >= 0.98L * bound); // a 40th of an edge misses the worst place by little
        REQUIRE(std::abs(attained - bound) <= rounding + 0x1p-50L * bound);
        std::cout << "  " << ratio << "  " << worst << "  " << bound << "  " << attained << "\n";
    }
    REQUIRE(error_at({1, 7, 30}, {0, 1, 0}) < 1e-13L); // at a vertex it is exact
    REQUIRE(error_at({7, 7, 7}, {0.2L, 0.5L, 0.3L}) < 1e-13L);
}

TEST_CASE("Ulrich: logarithmic depth keeps a relative step, the window encoding does not", "[articles]") {
    Camera window = camera_of(perspective(centred, {0.1, 1e4})), logarithmic = window;
    logarithmic.encoding = Encoding::logarithmic;
    logarithmic.far_plane = 1e4;
    logarithmic.log_c = 10;
    const auto relative = [](const Camera& camera, double z) {
        return depth_spacing(camera, DepthBits::d24, 3, 4, z) / z;
    };
    // dz/dv/z → ln(C f + 1) for C z ≫ 1, whatever z; for the window encoding it grows as z/n.
    const double step = std::log(1e5 + 1) / 16777215;
    for (const double z : {10.0, 100.0, 9000.0})
        REQUIRE(relative(logarithmic, z) == Approx(step).epsilon(0.011));
    REQUIRE(relative(window, 1000) / relative(window, 10) == Approx(100).epsilon(0.01));
    REQUIRE(relative(window, 9000) > 500 * relative(logarithmic, 9000));
}

TEST_CASE("Lenaerts: a position lies on the pixel's ray, perspective or parallel, in view and world", "[articles]") {
    // The near and far plane's corners, interpolated across the screen: P = near + t (far − near) is his formula of the
    // orthographic case. With t = (z − n)/(f − n) it holds for a perspective too. origin + z direction is the same point.
    Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
    view.topLeftCorner<3, 3>() << 0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6;
    view.topRightCorner<3, 1>() << 3, -4, 12;
    const Eigen::Vector3d origin(100, 200, -300);

    Real worst_view = 0, worst_world = 0;
    for (const Kind& kind : kinds()) {
        if (contains(kind.name, "infinite"))
            continue;
        for (const bool shifted : {false, true}) {
            Projection p = kind.projection;
            if (shifted) // a camera centre beside the origin, as in stereo pairs
                p.matrix.col(3) += p.matrix.leftCols<3>() * Point(-0.5L, 0.25L, 0);
            const Camera camera = camera_of(p);
            const Rays ray = camera_rays(camera), world = rays_in_world(ray, view, origin);
            const auto inverse = p.matrix.inverse().eval();
            const auto corner = [&](Real x, Real y, Real z) -> Point {
                return (inverse * Eigen::Matrix<Real, 4, 1>(x, y, z, 1)).eval().hnormalized();
            };
            const auto across = [&](Real s, Real t, Real z) -> Point {
                const Real top = p.convention.clip_y == ClipY::up ? 1 : -1;
                return (1 - t) * ((1 - s) * corner(-1, top, z) + s * corner(1, top, z)) +
                       t * ((1 - s) * corner(-1, -top, z) + s * corner(1, -top, z));
            };
            INFO(kind.name << (shifted ? ", centre shifted" : ""));
            REQUIRE(ray.w_is_depth);
            if (p.is_perspective()) {
                // One place for all rays.
                const Point centre(shifted ? 0.5L : 0, shifted ? -0.25L : 0, 0);
                REQUIRE((ray.origin.col(2) - centre).norm() <= position_tolerance);
                REQUIRE(ray.origin.leftCols<2>().norm() <= position_tolerance);
            } else {
                REQUIRE(ray.direction.leftCols<2>().isZero(0)); // one direction
            }
            for (const double x : {0.5, 20.0, 63.5})
                for (const double y : {0.5, 31.5}) {
                    const Point pixel(x, y, 1);
                    for (const double z : {0.5, 7.0, 100.0}) {
                        const Real s = x / Real{64}, t = y / Real{32}, along = (z - 0.5L) / 99.5L;
                        const Point near = across(s, t, p.clip_near()), far = across(s, t, p.clip_far());
                        const Point his = near + along * (far - near);
                        const Point ours = ray.origin * pixel + z * (ray.direction * pixel);
                        worst_view = std::max(worst_view, (ours - his).norm() / his.norm());
                        REQUIRE((ours - his).norm() <= position_tolerance * his.norm());
                        REQUIRE(std::abs(depth_of(camera, ours) - z) <= position_tolerance * z);

                        const Point seen = view.inverse().cast<Real>().topRows<3>() * his.homogeneous();
                        const Point in_world = world.origin * pixel + z * (world.direction * pixel);
                        const Real error = (in_world + origin.cast<Real>() - seen).norm() / seen.norm();
                        worst_world = std::max(worst_world, error);
                        REQUIRE(error <= 0x1p-46L); // the view matrix was inverted in double here
                    }
                }
        }
    }
    std::cout << "Lenaerts: worst relative difference of a position, view " << worst_view << ", world " << worst_world
              << "\n";
}

TEST_CASE("Lenaerts: his depth and his corner rays are ours", "[articles]") {
    // z = −(z_ndc M44 − M43)/(z_ndc M34 − M33), M for row vectors. Rays: far − near of a corner, divided by its z; origins:
    // near − ray · near.z; both interpolated across the screen; position = origin + z ray, z negative ahead.
    Real worst = 0;
    for (const Kind& kind : kinds()) {
        if (!contains(kind.name, "OpenGL") || contains(kind.name, "infinite"))
            continue;
        for (const Real shift : {0.0L, 0.25L}) { // of the camera centre, along the view axis and aside
            Projection p = kind.projection;
            p.matrix.col(3) += p.matrix.leftCols<3>() * Point(-shift, shift, 2 * shift);
            const Camera camera = camera_of(p);
            const Rays ray = camera_rays(camera);
            const auto m = p.matrix.transpose().eval();
            const auto inverse = p.matrix.inverse().eval();
            std::array<Point, 4> origins, directions; // top left, top right, bottom left, bottom right
            for (std::size_t i = 0; i < 4; ++i) {
                const auto corner = [&](Real z) -> Point {
                    return (inverse * Eigen::Matrix<Real, 4, 1>(i % 2 ? 1 : -1, i / 2 ? -1 : 1, z, 1))
                        .eval()
                        .hnormalized();
                };
                const Point near = corner(p.clip_near()), far = corner(p.clip_far());
                directions[i] = (far - near) / (far - near).z();
                origins[i] = near - directions[i] * near.z();
                REQUIRE(std::abs(origins[i].z()) <= position_tolerance);
            }
            const auto across = [](const std::array<Point, 4>& at, Real s, Real t) -> Point {
                return (1 - t) * ((1 - s) * at[0] + s * at[1]) + t * ((1 - s) * at[2] + s * at[3]);
            };
            INFO(kind.name << ", shift " << shift);
            for (const double x : {0.5, 20.0, 63.5})
                for (const double stored : {0.125, 0.5, 0.75}) {
                    const Real z_ndc = 2 * Real{stored} - 1, s = x / Real{64}, t = 0.25L;
                    const Real z = -(z_ndc * m(3, 3) - m(3, 2)) / (z_ndc * m(2, 3) - m(2, 2));
                    const Real ours = view_depth(camera, Storage::float32, x, 8, stored);
                    REQUIRE(std::abs(ours + z) <= position_tolerance * 1024 * std::abs(z)); // κ up to 2 · far/near
                    const Point his = across(origins, s, t) + z * across(directions, s, t);
                    const Point pixel(x, 8, 1), position = ray.origin * pixel - z * (ray.direction * pixel);
                    worst = std::max(worst, (position - his).norm() / his.norm());
                    REQUIRE((position - his).norm() <= position_tolerance * 16 * his.norm());
                }
        }
    }
    std::cout << "Lenaerts: corner origins and rays, worst relative difference of a position " << worst << "\n";
}

TEST_CASE("Cancellation: what engines lose at far/near = 1e6", "[articles]") {
    constexpr double near = 0.1, far = 1e5;
    constexpr int width = 1024, height = 1024;
    const Camera camera = camera_of(perspective(centred, {near, far}), width, height);
    std::vector<float> stored, decoded(static_cast<std::size_t>(width) * height);
    for (std::size_t i = 0; i < decoded.size(); ++i) { // depths spread evenly over the logarithm
        const double z =
            near * std::pow(far / near, (static_cast<double>(i) + 0.5) / static_cast<double>(decoded.size()));
        stored.push_back(static_cast<float>((1 / near - 1 / z) / (1 / near - 1 / far)));
    }
    const Device device = Device::open("cpu");
    linearize({Image::from_host(device, Element::f32, stored.data(), {width, height}), camera}, {Background::decode})
        .image.download(decoded.data());

    Real naive = 0, ours = 0;
    const auto slope = static_cast<float>(1 / far - 1 / near), start = static_cast<float>(1 / near);
    for (std::size_t i = 0; i < decoded.size(); ++i) {
        const volatile float product = slope * stored[i]; // no fused multiply-add, as most shaders compile
        const Real exact = 1 / ((1 / Real{far} - 1 / Real{near}) * stored[i] + 1 / Real{near});
        naive = std::max(naive, std::abs(1 / (product + start) / exact - 1));
        ours = std::max(ours, std::abs(decoded[i] / exact - 1));
    }
    std::cout << "Cancellation: far/near = 1e6, worst relative error of 1/(Z d + W) in float " << naive
              << ", of linearize " << ours << "\n";
    REQUIRE(naive > 1e-3);

    // What is lost when nothing but a matrix in double is known, at far/near = 1e9.
    const Projection wide = perspective(centred, {1, 1e9});
    const Real kept = attainable_depth(camera_of(from_matrix(wide.matrix.cast<double>())), 3, 4);
    std::cout << "Cancellation: far/near = 1e9, a matrix in double shifts the far plane by "
              << std::abs(kept / 1e9L - 1) << " of its depth\n";
    REQUIRE(std::abs(attainable_depth(camera_of(wide), 3, 4) / 1e9L - 1) < 1e-9L);
    REQUIRE(ours <= linearize_ulp_fp64 * 0x1p-23);
}
