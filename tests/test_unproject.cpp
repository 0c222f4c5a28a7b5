// unproject against __float128: every kind of camera, in view and in world space.
// The tolerance is unproject_relative_error of the distance from the camera centre, and of that from the origin.

#include "catch.hpp"
#include "judge.hpp"

#include <fathom/fathom.hpp>

#include "quad.hpp"

using namespace fathom;
using oracle::Point;
using oracle::Quad;
using oracle::Subject;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Quad distance(const Point& a, const Point& b) {
    const Quad x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrtq(x * x + y * y + z * z);
}

Eigen::Matrix4d orthographic_matrix(double near, double far, double shear) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m(0, 0) = 0.2;
    m(1, 1) = 0.25;
    m(2, 2) = -2 / (far - near);
    m(2, 3) = -(far + near) / (far - near);
    m(0, 2) = shear;
    m(1, 2) = -shear / 2;
    return m;
}

std::vector<Subject> cameras() {
    const double wide = 150 * std::acos(-1.0) / 180;
    const DepthSpan room{0.1, 100}, deep{0.01, 1e7}, reversed{0.1, infinity, DepthOrder::reversed};
    const Convention opencv{ClipZ::zero_to_one, ClipY::down, ViewAxes::opencv};
    const Eigen::Matrix4d matrix = oracle::perspective_matrix(0.7, 0.5, 0.1, 100);
    Subject bottom_up = oracle::from_field_of_view(1.1, 1.5, room);
    bottom_up.camera.rows = Rows::bottom_up;
    Subject metric = oracle::from_edges({-0.3, 0.1, -0.2, 0.1}, room, opencv);
    metric.camera.encoding = Encoding::view_z;
    Subject along_ray = oracle::from_field_of_view(2, 1, room);
    along_ray.camera.encoding = Encoding::ray_distance;
    Subject tilted_along_ray = oracle::from_matrix(oracle::tilted(matrix, 0.2, -0.1));
    tilted_along_ray.camera.encoding = Encoding::ray_distance;
    return {
        oracle::named(oracle::from_field_of_view(1.1, 1.5, room), "perspective"),
        oracle::named(oracle::from_field_of_view(1.1, 1.5, deep), "far/near 1e9"),
        oracle::named(oracle::from_field_of_view(1.1, 1.5, reversed, Convention::vulkan()), "reversed infinite Vulkan"),
        oracle::named(oracle::from_field_of_view(1.1, 1.5, room, Convention::direct3d()), "Direct3D"),
        oracle::named(oracle::from_intrinsics({9000, 9100, 8000.3, 8200.7, 16384, 16384}, room, opencv), "intrinsics"),
        oracle::named(bottom_up, "rows bottom up"),
        oracle::named(oracle::from_edges({3, 3.1, -7, -6.9}, room), "crop far outside"),
        oracle::named(oracle::from_field_of_view(wide, 1, room), "150 degrees"),
        oracle::named(with_oblique_near_plane(oracle::from_field_of_view(1, 1, room), {0.3, 0.2, -1, -0.2}), "oblique"),
        oracle::named(metric, "view-z"),
        oracle::named(along_ray, "ray distance"),
        oracle::named(tilted_along_ray, "ray distance, tilted"),
        oracle::named(oracle::from_orthographic({-5, 7, -4, 3}, {-3, 1000}), "orthographic"),
        oracle::named(oracle::from_orthographic({1e6, 1e6 + 12, -4, 3}, {1, 1000}, opencv), "orthographic far aside"),
        oracle::named(
            with_oblique_near_plane(oracle::from_orthographic({-5, 7, -4, 3}, {-3, 100}), {0.3, -0.2, -1, -2}),
            "oblique orthographic"),
        oracle::named(oracle::from_matrix(orthographic_matrix(1, 100, 0.3)), "sheared orthographic"),
        oracle::named(oracle::from_matrix(matrix), "matrix"),
        oracle::named(oracle::from_matrix(oracle::moved(matrix, {0.03, 0, 0})), "centre moved sideways"),
        oracle::named(oracle::from_matrix(oracle::moved(matrix, {3, -1, 2})), "centre moved"),
        oracle::named(oracle::from_matrix(oracle::tilted(matrix, 0.2, -0.1)), "tilted"),
        oracle::named(oracle::from_matrix(oracle::tilted(oracle::moved(matrix, {0.3, -0.1, 0.2}), 0.2, -0.1)),
                      "tilted and moved"),
        oracle::named(oracle::from_matrix(oracle::perspective_matrix(-0.7, 0.5, 1e-6, 1e3)), "mirrored, near 1e-6"),
        oracle::named(oracle::from_field_of_view(1.1, 1.5, {1e5, 1e8}), "a scene of 1e8"),
    };
}

struct Placing {
    const char* name;
    std::optional<Eigen::Matrix4d> view;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

std::vector<Placing> placings() {
    Eigen::Isometry3d view = Eigen::Isometry3d::Identity();
    view.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -0.5).normalized()));
    const Eigen::Vector3d centre(1e6 + 0.1, -1e6 + 0.7, 2e6);
    view.translate(-centre);
    return {
        {"view", std::nullopt}, {"world", view.matrix()}, {"world about its camera", view.matrix(), {1e6, -1e6, 2e6}}};
}

struct Worst {
    double relative = 0, share = 0; // of the distance, in 2⁻²⁴; of the bound
    std::string where;
};

void check(const Subject& plain, const Placing& placing, Arithmetic arithmetic, int channels, Worst& worst) {
    std::mt19937 random(99);
    Subject subject = plain;
    subject.camera.view = placing.view;
    const oracle::Truth truth(subject, Storage::float32);
    const Form form = depth_form(subject.camera).form;
    const oracle::Promise promise = oracle::promise(form, arithmetic);
    const Point centre = placing.view ? truth.in_world(truth.centre(), placing.origin) : truth.centre();
    const Quad centre_away = distance(centre, {});
    const Space space = placing.view ? Space::world : Space::view;
    oracle::Faults faults;
    long judged = 0;
    for (const oracle::Patch& patch :
         {oracle::Patch{0, 0, 37, 9}, oracle::Patch{16384 - 35, 16384 - 9, 35, 9}, oracle::Patch{8180, 8188, 33, 9}}) {
        const std::vector<float> values = oracle::stored_values(subject, truth, patch, random);
        const auto step = static_cast<std::size_t>(channels);
        std::vector<float> positions(values.size() * step);
        const Image image =
            Image::from_host(oracle::device(arithmetic), Element::f32, values.data(), {patch.width, patch.height});
        unproject({image, subject.camera, Storage::float32, patch.x, patch.y},
                  {.space = space, .origin = placing.origin, .channels = channels, .background = Background::decode})
            .download(positions.data());
        for (std::size_t i = 0; i < values.size(); ++i) {
            const auto v = static_cast<double>(values[i]);
            const auto columns = static_cast<std::size_t>(patch.width);
            const double x = patch.x + static_cast<double>(i % columns) + 0.5,
                         y = patch.y + static_cast<double>(i / columns) + 0.5;
            const float* got = &positions[i * step];
            const Quad depth = truth.depth(v, x, y), condition = truth.condition(form, v, x, y);
            const bool surface = truth.in_range(v) && truth.in_front(depth) && fabsq(depth) < 1e37;
            const auto fault = [&](const std::string& what) {
                std::ostringstream text;
                text << subject.name << ", " << placing.name << ", v = " << v << " at (" << x << ", " << y << "): ("
                     << got[0] << ", " << got[1] << ", " << got[2] << ") " << what << '\n';
                faults.add(text.str());
            };
            if (channels == 4 && got[3] != (std::isnan(got[0]) ? 0.0f : 1.0f))
                fault("has a wrong fourth component");
            if (std::isnan(got[0]) != std::isnan(got[1]) || std::isnan(got[0]) != std::isnan(got[2]))
                fault("is only partly a position");
            if (!(promise.condition * condition < 0.01) || fabsq(depth) > 1e37)
                continue; // not even the sign of the depth is promised, or a float may not hold the position
            if (std::isnan(got[0]) || !surface) {
                if (std::isnan(got[0]) == surface)
                    fault("is not what the stored value is");
                continue;
            }
            const Point view = truth.position(depth, x, y);
            const Point exact = placing.view ? truth.in_world(view, placing.origin) : view;
            const Quad away = distance(exact, centre) + centre_away;
            const Quad error = distance({got[0], got[1], got[2]}, exact);
            const Quad bound =
                unproject_relative_error * away + promise.condition * condition * distance(exact, centre);
            ++judged;
            const auto share = static_cast<double>(error / bound);
            if (share > worst.share) {
                worst.share = share;
                worst.relative = static_cast<double>(error / away) * 0x1p24;
                std::ostringstream text;
                text << subject.name << ", v = " << v << " at (" << x << ", " << y << ")";
                worst.where = text.str();
            }
            if (!(share <= 1))
                fault("but exactly (" + oracle::text_of(exact[0]) + ", " + oracle::text_of(exact[1]) + ", " +
                      oracle::text_of(exact[2]) + "): " + std::to_string(share) + " of the bound");
        }
    }
    INFO(subject.name << ", " << placing.name);
    CHECK(judged > 100);
    CHECK(faults.text() == "");
}

} // namespace

TEST_CASE("unproject: positions are within their bound, in view and in world space", "[unproject][exact]") {
    for (const Arithmetic arithmetic : oracle::arithmetics())
        for (const Placing& placing : placings()) {
            Worst worst;
            for (const Subject& subject : cameras())
                for (const int channels : {3, 4})
                    check(subject, placing, arithmetic, channels, worst);
            std::printf("unproject, %-24s %-10s worst %.3f * 2^-24 of the distance, %.3f of the bound, %s\n",
                        placing.name, oracle::name(arithmetic), worst.relative, worst.share, worst.where.c_str());
        }
}

TEST_CASE("unproject: an invalid pixel has no position", "[unproject]") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    Camera camera{.projection = perspective(1.0, 1.0, {1, 4}), .width = 6, .height = 1};
    for (const Background background : {Background::inf, Background::nan, Background::decode})
        for (const int channels : {3, 4}) {
            const std::vector<float> values{1.0f, nan, -0.5f, 2.0f, INFINITY, 0.5f};
            std::vector<float> p(values.size() * static_cast<std::size_t>(channels));
            const Image image = Image::from_host(oracle::device(), Element::f32, values.data(), {6, 1});
            unproject({image, camera}, {.channels = channels, .background = background}).download(p.data());
            for (int i = 0; i < 6; ++i) {
                const bool surface = i == 5 || (i == 0 && background == Background::decode);
                const float* at = &p[static_cast<std::size_t>(i * channels)];
                INFO(i << ", " << channels << " channels");
                CHECK(std::isnan(at[0]) != surface);
                CHECK(std::isnan(at[1]) != surface);
                CHECK(std::isnan(at[2]) != surface);
                if (channels == 4)
                    CHECK(at[3] == (surface ? 1.0f : 0.0f));
            }
        }
}

TEST_CASE("unproject: the depth of a position is the linearized depth, to the bit", "[unproject]") {
    for (const Subject& subject : cameras()) {
        if (!camera_rays(subject.camera).w_is_depth)
            continue;
        const oracle::Truth truth(subject, Storage::float32);
        std::mt19937 random(3);
        const oracle::Patch patch{100, 200, 37, 5};
        const std::vector<float> values = oracle::stored_values(subject, truth, patch, random);
        const StoredDepth stored{
            Image::from_host(oracle::device(), Element::f32, values.data(), {patch.width, patch.height}),
            subject.camera, Storage::float32, patch.x, patch.y};
        std::vector<float> z(values.size()), p(3 * values.size());
        linearize(stored).image.download(z.data());
        unproject(stored).download(p.data());
        const float ahead = subject.camera.projection.convention.view_axes == ViewAxes::opengl ? -1.0f : 1.0f;
        for (std::size_t i = 0; i < z.size(); ++i)
            if (std::isfinite(z[i]))
                REQUIRE(p[3 * i + 2] * ahead == z[i]);
    }
}
