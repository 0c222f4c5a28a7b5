// dof through distorted pinholes, against rays from every part of a thin lens. The distortion and its inverse are the test's own.

#include "catch.hpp"
#include "images.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using Eigen::Matrix2d;
using Eigen::Vector2d;

namespace {

// A disc that is a part d too wide gives an edge another profile, which differs by (t/pi) sqrt(1 - t²)·2 d at most: d/pi.
constexpr double edge_of_shape = 1 / std::numbers::pi;

struct Brown {
    double f, cx, cy, k1, k2, p1, p2;

    Vector2d distorted(const Vector2d& at) const {
        const double x = at.x(), y = at.y(), r2 = x * x + y * y, g = 1 + k1 * r2 + k2 * r2 * r2;
        return {x * g + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * g + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
    }
    Matrix2d slopes(const Vector2d& at) const {
        constexpr double step = 1e-6;
        Matrix2d result;
        for (int i = 0; i < 2; ++i)
            result.col(i) =
                (distorted(at + step * Vector2d::Unit(i)) - distorted(at - step * Vector2d::Unit(i))) / (2 * step);
        return result;
    }
    /// Where a pixel's ray meets the plane at a depth of one: x right, y down.
    Vector2d slope_of(double px, double py) const {
        const Vector2d wanted((px - cx) / f, (py - cy) / f);
        Vector2d at = wanted;
        for (int i = 0; i < 30; ++i)
            at -= slopes(at).inverse() * (distorted(at) - wanted);
        return at;
    }
    double deformation(const Vector2d& at) const {
        const Vector2d sizes = Eigen::JacobiSVD<Matrix2d>(slopes(at)).singularValues();
        return (sizes.array() - 1).abs().maxCoeff();
    }
    Camera camera(int width, int height) const {
        Camera result;
        result.width = width;
        result.height = height;
        result.encoding = Encoding::view_z;
        result.projection = perspective(1, 1, {1, 2}, {.view_axes = ViewAxes::opencv});
        result.lens = LensModel{LensLaw::brown, f, f, cx, cy, {k1, k2, p1, p2}};
        return result;
    }
};

constexpr int width = 320, height = 240;
const Brown brown{300, 163, 118, -0.1, 0.02, 1e-3, -5e-4};

// A half-plane at a depth, on the side of a line, before a background at another depth.
struct Edge {
    Vector2d normal;
    double offset, depth, background;
    bool here(const Vector2d& at) const { return normal.dot(at) > offset; }
};

// What a ray from a point of the lens, through what the pixel has in focus, meets: 1 on the half-plane.
double seen(const Edge& edge, const Vector2d& slope, const Vector2d& on_lens, double focus) {
    return edge.here(on_lens + (slope * focus - on_lens) * edge.depth / focus) ? 1 : 0;
}

// The mean over the lens and over a pixel.
double truth(const Edge& edge, double x, double y, double radius, double focus) {
    constexpr int parts = 3, across = 48;
    double sum = 0;
    int rays = 0;
    for (int p = 0; p < parts * parts; ++p) {
        const Vector2d slope = brown.slope_of(x + (p % parts + 0.5) / parts, y + (p / parts + 0.5) / parts);
        for (int i = 0; i < across * across; ++i) {
            const Vector2d on_lens((2 * (i % across) + 1.0) / across - 1, (2 * (i / across) + 1.0) / across - 1);
            if (on_lens.norm() >= 1)
                continue;
            sum += seen(edge, slope, radius * on_lens, focus);
            ++rays;
        }
    }
    return sum / rays;
}

} // namespace

TEST_CASE("dof lenses: edges through brown are those that a thin lens makes, but for the circle's shape",
          "[dof][lens]") {
    const Device device = test_device();
    const Camera camera = brown.camera(width, height);
    constexpr double focus = 1.5, circle = 20;
    double worst = 0, worst_over = 0;
    constexpr int parts = 4;
    std::vector<Vector2d> slopes, of_parts; // of pixels, and of their parts
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            slopes.push_back(brown.slope_of(x + 0.5, y + 0.5));
            for (int p = 0; p < parts * parts; ++p)
                of_parts.push_back(brown.slope_of(x + (p % parts + 0.5) / parts, y + (p / parts + 0.5) / parts));
        }
    for (const auto& [depth, background] :
         {std::pair{2.0, 2.0}, {1.2, 1.5}}) { // behind the focus; before it and what is sharp
        const double full = circle / std::abs(1 / focus - 1 / depth), radius = full / brown.f / 2;
        const CircleOfConfusion coc{.k = full / focus, .g = full};
        for (const Vector2d& place : {Vector2d(30, 25), Vector2d(160, 120), Vector2d(285, 200)})
            for (const double degrees : {20.0, 110.0}) {
                const Vector2d normal(std::cos(degrees * std::numbers::pi / 180),
                                      std::sin(degrees * std::numbers::pi / 180));
                const Edge edge{normal, normal.dot(brown.slope_of(place.x(), place.y())) * depth, depth, background};
                std::vector<float> z, color;
                for (std::size_t i = 0; i < slopes.size(); ++i) {
                    double part = 0;
                    for (std::size_t p = 0; p < parts * parts; ++p)
                        part += seen(edge, of_parts[parts * parts * i + p], Vector2d::Zero(), focus);
                    const bool is_here = edge.here(slopes[i] * depth);
                    z.push_back(static_cast<float>(is_here ? depth : background));
                    // A picture of two depths has an edge without pixels of both.
                    color.insert(color.end(), 3,
                                 static_cast<float>(depth == background ? part / (parts * parts) : is_here));
                }
                const std::vector<float> found =
                    images::floats(dof({Image::from_host(device, Element::f32, z.data(), {width, height}), camera},
                                       Image::from_host(device, Element::f32, color.data(), {width, height, 3}), coc));
                for (int y = static_cast<int>(place.y()) - 12; y <= place.y() + 12; y += 3)
                    for (int x = static_cast<int>(place.x()) - 12; x <= place.x() + 12; x += 3) {
                        const double off =
                            std::abs(static_cast<double>(found[static_cast<std::size_t>(3 * (y * width + x))]) -
                                     truth(edge, x, y, radius, focus));
                        const double allowed =
                            dof_edge_error + edge_of_shape * brown.deformation(brown.slope_of(x + 0.5, y + 0.5));
                        INFO(place.transpose()
                             << ", " << degrees << " degrees, " << depth << ", at " << x << ", " << y);
                        CHECK(off <= allowed);
                        worst = std::max(worst, off);
                        worst_over = std::max(worst_over, off / allowed);
                    }
            }
    }
    std::printf("dof through brown: off by %.4f of a step, %.2f of what is allowed\n", worst, worst_over);
}

TEST_CASE("dof lenses: how far a circle's shape is off is that of the distortion, and 15 % are the most",
          "[dof][lens]") {
    const Device device = test_device();
    const std::vector<float> z(width * height, 2.0f), color(3 * width * height, 0.5f);
    const auto blurred = [&](const Camera& camera) {
        return dof({Image::from_host(device, Element::f32, z.data(), {camera.width, camera.height}), camera},
                   Image::from_host(device, Element::f32, color.data(), {camera.width, camera.height, 3}),
                   {.k = 80, .g = 120});
    };
    double worst = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            worst = std::max(worst, brown.deformation(brown.slope_of(x + 0.5, y + 0.5)));
    CHECK(circle_deformation(brown.camera(width, height)) == Approx(worst).epsilon(1e-3));
    CHECK(worst < dof_shape_error);
    CHECK_NOTHROW(blurred(brown.camera(width, height)));
    Brown wide = brown;
    wide.k1 = -0.14;
    CHECK(circle_deformation(wide.camera(width, height)) > dof_shape_error);
    CHECK_THROWS_WITH(blurred(wide.camera(width, height)),
                      ContainsSubstring("lens brown") && ContainsSubstring("15 % at most"));
    Camera fisheye = brown.camera(width, height);
    fisheye.lens->law = LensLaw::equidistant;
    fisheye.lens->k = {};
    CHECK_THROWS_WITH(blurred(fisheye), ContainsSubstring("lens equidistant"));
    Camera pinhole = brown.camera(width, height);
    pinhole.lens.reset();
    CHECK(circle_deformation(pinhole) == 0);
}
