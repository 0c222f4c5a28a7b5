// Builders: what a projection is told is what comes back. Points are laid out from the builder's own parameters, go
// through the matrix in long double, and must return from the pixel and the stored value to where they were.

#include "catch.hpp"
#include "seen.hpp"
#include "text.hpp"

#include <fathom/camera.hpp>

using namespace fathom;
using namespace fathom::seen;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// A matrix, a product and a quotient in long double: fewer than 2⁷ roundings of 2⁻⁶⁴, on numbers of size one.
constexpr Real clip_tolerance = 0x1p-57L;
// The same after an inverse; relative to the distance.
constexpr Real position_tolerance = 0x1p-57L;
// The stored value was rounded to double, and back in depth that counts κ times, or z/near times where the clip range
// −1..1 lost the digits of a reversed far end; as much again for everything else.
constexpr Real depth_tolerance_per_condition = 0x1p-52L;

struct Edges {
    Real left, right, bottom, top;
};

struct Built {
    std::string name;
    Projection projection;
    Edges edges; ///< perspective: slopes x/Z and y/Z; orthographic: x and y
    double near, far;
};

// The point at the given shares of the width (from the left), the height (from the bottom) and the depth (from near).
Point point_at(const Built& built, Real across, Real up, Real z) {
    const Real size = built.projection.is_perspective() ? z : 1;
    const Edges& e = built.edges;
    const Point point(size * (e.left + (e.right - e.left) * across), size * (e.bottom + (e.top - e.bottom) * up), -z);
    return turned(built.projection.convention.view_axes, point);
}

// 0 at the near plane, 1 at the far one.
Real share_of_depth(const Built& built, Real z) {
    const Real n = built.near, f = built.far;
    return built.projection.is_perspective() ? (1 / n - 1 / z) / (1 / n - 1 / f) : (z - n) / (f - n);
}

std::vector<Convention> conventions() {
    std::vector<Convention> all;
    for (const ClipZ clip_z : {ClipZ::negative_one_to_one, ClipZ::zero_to_one})
        for (const ClipY clip_y : {ClipY::up, ClipY::down})
            for (const ViewAxes axes : {ViewAxes::opengl, ViewAxes::directx, ViewAxes::opencv})
                all.push_back({clip_z, clip_y, axes});
    return all;
}

std::vector<Built> builders() {
    const double fov = std::numbers::pi / 3, n = 0.25;
    const Real high = std::tan(static_cast<Real>(fov) / 2), wide = 1.5L * high;
    std::vector<Built> all;
    for (const Convention& c : conventions())
        for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed}) {
            for (const double far : {64.0, 1e4, infinity}) {
                const DepthSpan span{n, far, order};
                all.push_back({"field of view", perspective(fov, 1.5, span, c), {-wide, wide, -high, high}, n, far});
                all.push_back({"edges",
                               perspective(FrustumEdges{-0.125, 0.25, -0.0625, 0.3125}, span, c),
                               {-0.5, 1, -0.25, 1.25},
                               n,
                               far});
                // 64 × 32 pixels with fx = 32, fy = 16: slopes (u − cx)/fx, v counted from the top.
                all.push_back({"intrinsics",
                               perspective(Intrinsics{32, 16, 20, 12, 64, 32}, span, c),
                               {-20.0L / 32, 44.0L / 32, -20.0L / 16, 12.0L / 16},
                               n,
                               far});
            }
            const FrustumEdges box{-3, 5, -2, 7};
            all.push_back({"orthographic", orthographic(box, {0.25, 64, order}, c), {-3, 5, -2, 7}, 0.25, 64});
            all.push_back({"behind the viewer", orthographic(box, {-10, 30, order}, c), {-3, 5, -2, 7}, -10, 30});
        }
    return all;
}

} // namespace

TEST_CASE("projection: every builder brings a point back to where it was", "[projection]") {
    Real worst_clip = 0, worst_depth = 0, worst_position = 0;
    int points = 0;
    for (const Built& built : builders()) {
        Camera camera = camera_of(built.projection);
        for (const auto& [rows, range] :
             {std::pair{Rows::top_down, std::array{0.0, 1.0}}, std::pair{Rows::bottom_up, std::array{0.0, 1.0}},
              std::pair{Rows::top_down, std::array{1.0, 0.0}}, std::pair{Rows::bottom_up, std::array{0.25, 0.75}}}) {
            camera.rows = rows;
            camera.depth_range = range;
            const DepthForm form = depth_form(camera);
            const Rays ray = camera_rays(camera);
            INFO(built.name << ", far " << built.far << ", form " << to_string(form.form));
            for (const auto& [px, py] : {std::pair{0.5, 0.5}, std::pair{63.5, 7.25}, std::pair{21.0, 31.5}})
                for (const double share : {0.0, 0.015625, 0.5, 1.0}) {
                    const double far = std::min(built.far, 1e4);
                    const double z = built.near + share * (far - built.near);
                    const Real across = px / camera.width;
                    const Real down = py / camera.height, up = rows == Rows::top_down ? 1 - down : down;
                    const Point point = point_at(built, across, up, z);

                    // Forwards: the matrix puts the point at its pixel and at its share of the depth range.
                    const Place place = place_of(camera, point);
                    const bool reversed = built.projection.order == DepthOrder::reversed;
                    const Real share_stored = reversed ? 1 - share_of_depth(built, z) : share_of_depth(built, z);
                    const Real stored = range[0] + share_stored * (range[1] - range[0]);
                    const Real clip_error =
                        std::max({std::abs(place.x - px) / camera.width, std::abs(place.y - py) / camera.height,
                                  std::abs(place.stored - stored)});
                    worst_clip = std::max(worst_clip, clip_error);
                    REQUIRE(clip_error <= clip_tolerance);

                    // Backwards: from the pixel and the stored value to the point.
                    const Real back = view_depth(camera, Storage::float32, px, py, static_cast<double>(place.stored));
                    const Real scale = built.projection.is_perspective() ? z : 1; // an orthographic z may be 0
                    const Real kappa = std::max(condition(form, place.stored, px, py), z / Real{built.near});
                    const Real depth_error = std::abs(back - z) / (scale * kappa);
                    worst_depth = std::max(worst_depth, depth_error);
                    REQUIRE(depth_error <= depth_tolerance_per_condition);
                    REQUIRE(std::abs(stored_depth(camera, Storage::float32, px, py, z) - place.stored) <=
                            clip_tolerance);

                    const Point pixel(px, py, 1);
                    REQUIRE(ray.w_is_depth);
                    const Real position_error =
                        (ray.origin * pixel + z * (ray.direction * pixel) - point).norm() / point.norm();
                    worst_position = std::max(worst_position, position_error);
                    REQUIRE(position_error <= position_tolerance);
                    ++points;
                }
        }
    }
    std::cout << "projection: " << points << " points; worst clip error " << worst_clip << " (limit " << clip_tolerance
              << "), depth " << worst_depth << " per condition (limit " << depth_tolerance_per_condition
              << "), position " << worst_position << " (limit " << position_tolerance << ")\n";
}

TEST_CASE("projection: a matrix says by itself whether depth is reversed", "[projection]") {
    const auto rounded = [](const Projection& p) {
        std::array<float, 16> columns{};
        Eigen::Map<Eigen::Matrix4f>(columns.data()) = p.matrix.cast<float>();
        return from_column_major(columns, p.convention);
    };
    const auto check = [&](const Projection& p, const std::string& what) {
        INFO(what << (p.order == DepthOrder::reversed ? ", reversed" : ", standard"));
        REQUIRE(from_matrix(p.matrix.cast<double>(), p.convention).order == p.order);
        REQUIRE(rounded(p).order == p.order);
    };
    for (const Built& built : builders()) {
        const Projection& p = built.projection;
        check(p, built.name);

        const Point ahead = turned(p.convention.view_axes, {0.2L, -0.1L, -1});
        const Eigen::Vector4d plane(static_cast<double>(ahead.x()), static_cast<double>(ahead.y()),
                                    static_cast<double>(ahead.z()), -0.75);
        check(with_oblique_near_plane(p, plane), "oblique");

        // A fourth row with x and y, and a camera centre that is not the origin, on both sides of it. A matrix of floats
        // keeps near and far apart only where the shift leaves them digits.
        if (p.is_perspective()) {
            Projection tilted = p;
            tilted.matrix(3, 0) = 0.06L;
            tilted.matrix(3, 1) = -0.04L;
            check(tilted, "tilted");
        } else {
            Projection keystone = p;
            keystone.matrix(3, 0) = 0.02L;
            check(keystone, "keystone without a camera centre");
        }
        for (const Real shift : {-100.0L, -5.0L, 5.0L, 100.0L}) {
            Projection shifted = p;
            Projection::Matrix move = Projection::Matrix::Identity();
            move.topRightCorner<3, 1>() << 0.3L, -0.2L, shift;
            shifted.matrix = p.matrix * move;
            check(shifted, text("centre shifted by ", shift, ", ", built.name, ", far ", built.far, "\n", p.matrix));
        }
    }
}

TEST_CASE("projection: 16 floats in columns are the same matrix", "[projection]") {
    const Projection p = perspective(FrustumEdges{-1, 2, -1, 1}, {0.5, 100});
    std::array<float, 16> columns{};
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            columns[static_cast<std::size_t>(4 * column + row)] = static_cast<float>(p.matrix(row, column));
    REQUIRE(from_column_major(columns).matrix == p.matrix.cast<float>().cast<Real>());
}

TEST_CASE("projection: calibrated centres and corner counts differ by half a pixel", "[projection]") {
    // A centred pinhole of 640 × 480: the principal point is (320, 240) from the corner, (319.5, 239.5) from the centre
    // of the first pixel.
    const double fov = 2 * std::atan(240.0 / 500.0);
    const Projection angle = perspective(fov, 640.0 / 480.0, {0.1, 10});
    const Projection pinhole = perspective(Intrinsics{500, 500, 319.5 + 0.5, 239.5 + 0.5, 640, 480}, {0.1, 10});
    const Real difference = (angle.matrix - pinhole.matrix).cwiseAbs().maxCoeff();
    REQUIRE(difference < 0x1p-50L); // the angle is a double
    const Rays ray = camera_rays(camera_of(pinhole, 640, 480));
    REQUIRE((ray.direction * Point(320, 240, 1) - Point(0, 0, -1)).norm() < position_tolerance);
    REQUIRE((ray.direction * Point(820, 240, 1) - Point(1, 0, -1)).norm() < position_tolerance);
    REQUIRE((ray.direction * Point(320, 740, 1) - Point(0, -1, -1)).norm() < position_tolerance);
}

TEST_CASE("projection: what cannot be one is refused with its reason", "[projection]") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const FrustumEdges edges{-1, 1, -1, 1};
    const Projection good = perspective(edges, {1, 100}), flat = orthographic(edges, {1, 100});
    const auto with_element = [&](double value) {
        Eigen::Matrix4d m = good.matrix.cast<double>();
        m(1, 2) = value;
        return m;
    };
    Eigen::Matrix4d singular = good.matrix.cast<double>();
    singular.row(2) = 2 * singular.row(3);
    Eigen::Matrix4d nearly = good.matrix.cast<double>(); // no scaling of rows and columns tells x from y
    nearly.topLeftCorner<2, 2>() << 1, 1, 1, 1 + 1e-10;

    const auto seen = [](const auto&... of) { return perspective(of...); };
    const auto parallel = [](const auto&... of) { return orthographic(of...); };
    const auto cut = [](const auto&... of) { return with_oblique_near_plane(of...); };
    const auto given = [](const Eigen::Matrix4d& matrix) { return from_matrix(matrix); };
    const auto refused = [](const std::string& reason, const auto& build, const auto&... of) {
        const std::string said = refusal([&] { build(of...); });
        INFO("expected: " << reason << "\nsaid: " << said);
        REQUIRE(contains(said, reason));
    };
    refused("near = 0 must be above 0 for a perspective", seen, edges, DepthSpan{0, 100});
    refused("near = -1 must be above 0", seen, edges, DepthSpan{-1, 100});
    refused("near = nan must be above 0", seen, edges, DepthSpan{nan, 100});
    refused("far = 2 must be greater than near = 2", seen, edges, DepthSpan{2, 2});
    refused("far = 1 must be greater than near = 2", seen, edges, DepthSpan{2, 1});
    refused("far = nan must be greater than near = 1", seen, 1.0, 1.5, DepthSpan{1, nan});
    refused("fov_y = 0 must lie between 0 and pi", seen, 0.0, 1.5, DepthSpan{1, 2});
    refused("fov_y = 3.2 must lie between 0 and pi", seen, 3.2, 1.5, DepthSpan{1, 2});
    refused("aspect = 0 must be above 0", seen, 1.0, 0.0, DepthSpan{1, 2});
    refused("left = 1 and right = 1", seen, FrustumEdges{1, 1, 0, 2}, DepthSpan{1, 2});
    refused("bottom = 2 and top = nan", seen, FrustumEdges{0, 1, 2, nan}, DepthSpan{1, 2});
    refused("fx = 0 and fy = 5", seen, Intrinsics{0, 5, 1, 1, 4, 4}, DepthSpan{1, 2});
    refused("\"view_axes\": \"directx\"", seen, Intrinsics{5, -5, 1, 1, 4, 4}, DepthSpan{1, 2});
    refused("cx = inf", seen, Intrinsics{5, 5, infinity, 1, 4, 4}, DepthSpan{1, 2});
    refused("0 x 4 pixels", seen, Intrinsics{5, 5, 1, 1, 0, 4}, DepthSpan{1, 2});
    refused("near = 3 and far = 3 must be finite and differ", parallel, edges, DepthSpan{3, 3});
    refused("far = inf must be finite", parallel, edges, DepthSpan{3, infinity});
    refused("not a finite number", given, with_element(nan));
    refused("not a finite number", given, with_element(infinity));
    refused("is singular: its condition number is inf", given, singular);
    refused("is singular: its condition number is ", given, nearly);
    nearly(1, 1) = 1 + 1.6e-9; // of a condition below the limit of 10^10
    REQUIRE_NOTHROW(from_matrix(nearly));
    refused("must be finite and have a normal", cut, good, Eigen::Vector4d{0, 0, -1, nan});
    refused("must be finite and have a normal", cut, good, Eigen::Vector4d{0, 0, 0, -1});
    refused("the camera centre is on the kept side", cut, good, Eigen::Vector4d{0, 0, -1, 0.5});
    refused("the camera centre is on the kept side", cut, good, Eigen::Vector4d{0, 0, -1, 0});
    refused("the camera centre is on the kept side", cut, good, Eigen::Vector4d{0, 0, 1, 2});
    refused("leaves nothing of the view volume", cut, good, Eigen::Vector4d{0, 0, -1, -101});
    refused("leaves nothing of the view volume", cut, flat, Eigen::Vector4d{0, 0, -1, -101});
    refused("keeps what lies towards the viewer", cut, flat, Eigen::Vector4d{0.3, 0, 1, 200});
    refused("keeps what lies towards the viewer", cut, flat, Eigen::Vector4d{1, 0, 0, 0});
}

TEST_CASE("projection: planes in the axes of the projection", "[projection]") {
    // The same plane, said in each set of axes, gives the same picture.
    const Point normal(0.3L, -0.2L, -0.9L);
    for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed}) {
        const auto stored = [&](ViewAxes axes) {
            const Point n = turned(axes, normal);
            const Convention convention{ClipZ::zero_to_one, ClipY::up, axes};
            const Projection p = with_oblique_near_plane(
                perspective(FrustumEdges{-1, 2, -1, 1}, {1, 50, order}, convention),
                {static_cast<double>(n.x()), static_cast<double>(n.y()), static_cast<double>(n.z()), -4});
            return place_of(camera_of(p), turned(axes, {3, -2, -17})).stored;
        };
        REQUIRE(std::abs(stored(ViewAxes::directx) - stored(ViewAxes::opengl)) < clip_tolerance);
        REQUIRE(std::abs(stored(ViewAxes::opencv) - stored(ViewAxes::opengl)) < clip_tolerance);
    }
}

TEST_CASE("projection: a matrix that is transposed or of other axes is refused", "[projection]") {
    const Projection right = perspective(1.0, 1.5, {0.1, 100});
    const Eigen::Matrix4d m = right.matrix.cast<double>();
    CHECK_NOTHROW(from_matrix(m));
    CHECK_THROWS_WITH(from_matrix(m.transpose()), ContainsSubstring("is transposed"));
    CHECK_THROWS_WITH(from_matrix(m, {.view_axes = ViewAxes::opencv}), ContainsSubstring("must have +1"));
    Eigen::Matrix4d ahead = m;
    ahead.col(2) *= -1;
    CHECK_THROWS_WITH(from_matrix(ahead), ContainsSubstring("must have -1"));
    CHECK_NOTHROW(from_matrix(ahead, {.view_axes = ViewAxes::opencv}));
    Camera unset;
    unset.width = unset.height = 4;
    CHECK_THROWS_WITH(depth_form(unset), ContainsSubstring("has no projection"));
}
