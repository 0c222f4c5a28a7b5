// Which form a camera gets, and why: the simplest that is exact, whatever rounding the matrix went through.

#include "catch.hpp"
#include "seen.hpp"

#include <fathom/camera.hpp>

using namespace fathom;
using namespace fathom::seen;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// From a stored value to a depth and back costs the two conditions, in long double: 2⁻⁶³ each way and as much again.
constexpr Real inverse_tolerance = 0x1p-59L;

const FrustumEdges edges{-0.4, 0.6, -0.3, 0.5}; // off-centre
const Eigen::Vector4d slanted{0.3, 0.2, -0.9, -2};

Camera encoded(Encoding encoding, Projection projection = perspective(edges, {0.5, 100})) {
    Camera camera = camera_of(projection, 161, 121);
    camera.encoding = encoding;
    camera.near_plane = 0.5;
    camera.far_plane = 100;
    camera.median = 5;
    return camera;
}

// As a program holds it: 16 floats.
Projection in_floats(const Projection& p) {
    return from_matrix(p.matrix.cast<float>().cast<double>(), p.convention);
}

Projection tilted(Projection p) {
    p.matrix(3, 0) = 0.06L;
    p.matrix(3, 1) = -0.04L;
    return p;
}

} // namespace

TEST_CASE("form: every kind of camera gets the simplest exact one", "[form]") {
    struct Expected {
        const char* kind;
        Projection projection;
        Form form;
        const char* reason;
    };
    const char* reciprocal = "1/z is affine in the stored value";
    const char* oblique = "a tilted near plane: 1/z is affine in the stored value and the pixel";
    const char* affine = "z is affine in the stored value";
    const char* oblique_affine =
        "orthographic rays and a tilted near plane: z is affine in the stored value and the pixel";
    const char* rational = "the projection's fourth row depends on x and y: z is a quotient of two affine functions";
    const DepthOrder reversed = DepthOrder::reversed;
    const auto d3d = Convention::direct3d(), vulkan = Convention::vulkan();
    const Projection box = orthographic({-3, 5, -2, 7}, {0.5, 100});
    Projection moved = perspective(edges, {0.5, 100});
    moved.matrix.col(3) += moved.matrix.leftCols<3>() * Point(0, 0, -3); // the centre is at (0, 0, 3)
    Projection aside = perspective(edges, {0.5, 100});
    aside.matrix.col(3) += aside.matrix.leftCols<3>() * Point(-0.5L, 0.25L, 0); // the centre is at (0.5, −0.25, 0)

    const std::vector<Expected> cases{
        {"centred", perspective(1.0, 4.0 / 3, {0.1, 1000}), Form::reciprocal, reciprocal},
        {"off-centre", perspective(edges, {0.1, 1000}), Form::reciprocal, reciprocal},
        {"infinite", perspective(edges, {0.1, infinity}), Form::reciprocal, reciprocal},
        {"reversed", perspective(edges, {0.1, 1000, reversed}, d3d), Form::reciprocal, reciprocal},
        {"reversed infinite", perspective(edges, {0.1, infinity, reversed}, vulkan), Form::reciprocal, reciprocal},
        {"reversed −1..1", perspective(edges, {0.1, 1000, reversed}), Form::reciprocal, reciprocal},
        {"centre aside", aside, Form::reciprocal, reciprocal},
        {"oblique", with_oblique_near_plane(perspective(edges, {0.1, 1000}), slanted), Form::reciprocal_affine,
         oblique},
        {"oblique infinite", with_oblique_near_plane(perspective(edges, {0.1, infinity}), slanted),
         Form::reciprocal_affine, oblique},
        {"parallel plane", with_oblique_near_plane(perspective(edges, {0.1, 1000}), {0, 0, -1, -2}), Form::reciprocal,
         reciprocal},
        {"orthographic", box, Form::affine, affine},
        {"orthographic reversed", orthographic({-3, 5, -2, 7}, {-4, 9, reversed}, vulkan), Form::affine, affine},
        {"orthographic oblique", with_oblique_near_plane(box, slanted), Form::affine, oblique_affine},
        {"tilt", tilted(perspective(edges, {0.1, 1000})), Form::rational, rational},
        {"centre ahead", moved, Form::rational, "z is a quotient of two affine functions of the stored value"},
    };
    for (const Expected& expected : cases)
        for (const bool rounded : {false, true}) {
            const Projection p = rounded ? in_floats(expected.projection) : expected.projection;
            for (const Storage storage : {Storage::float32, Storage::uint16, Storage::uint24}) {
                const DepthForm form = depth_form(camera_of(p, 1920, 1080), storage);
                INFO(expected.kind << (rounded ? " in floats" : "") << ", " << to_string(storage) << ": "
                                   << form.reason);
                REQUIRE(to_string(form.form) == std::string(to_string(expected.form)));
                REQUIRE(form.reason == expected.reason);
            }
        }
}

TEST_CASE("form: rounding a matrix never costs the simple form", "[form]") {
    // A thousand perspectives of odd proportions, off-centre, in floats, in images up to 16384 wide.
    std::uint32_t state = 1;
    const auto random = [&](double low, double high) {
        state = state * 1664525u + 1013904223u;
        return low + (high - low) * (state >> 8) * 0x1p-24;
    };
    for (int i = 0; i < 1000; ++i) {
        const double near = std::exp2(random(-10, 4)), far = near * std::exp2(random(1, 30));
        const FrustumEdges e{-near * random(0.1, 3), near * random(0.1, 3), -near * random(0.1, 3),
                             near * random(0.1, 3)};
        const Projection p =
            in_floats(perspective(e, {near, far, i % 2 ? DepthOrder::reversed : DepthOrder::standard}));
        INFO(p.matrix);
        const int width = 1 << (i % 15);
        REQUIRE(depth_form(camera_of(p, width, width)).form == Form::reciprocal);
        REQUIRE(camera_rays(camera_of(p, width, width)).w_is_depth);
        REQUIRE(camera_rays(camera_of(p, width, width)).origin.isZero(0));
        const double slant = near * random(1.5, 20);
        const Eigen::Vector4d plane(random(-0.2, 0.2), random(0.05, 0.2), -1, -slant);
        if (slant * 2 < far) {
            const Projection oblique = in_floats(with_oblique_near_plane(perspective(e, {near, far}), plane));
            REQUIRE(depth_form(camera_of(oblique, width, width)).form == Form::reciprocal_affine);
        }
    }
}

TEST_CASE("form: stored_depth is the inverse of view_depth", "[form]") {
    std::vector<Camera> cameras;
    const Projection plain = perspective(edges, {0.5, 100});
    const Projection box = orthographic({-3, 5, -2, 7}, {0.5, 100});
    for (const Projection& p :
         {plain, perspective(edges, {0.5, 100, DepthOrder::reversed}, Convention::direct3d()),
          perspective(edges, {0.5, infinity}), with_oblique_near_plane(plain, {0.1, 0.1, -1, -0.6}), box,
          with_oblique_near_plane(box, {0.1, 0.1, -1, -0.6}), tilted(plain)})
        for (const std::array<double, 2> range : {std::array{0.0, 1.0}, {1.0, 0.0}, {0.125, 0.5}}) {
            cameras.push_back(camera_of(p, 161, 121));
            cameras.back().depth_range = range;
        }
    for (const Encoding encoding :
         {Encoding::view_z, Encoding::ray_distance, Encoding::linear, Encoding::logarithmic, Encoding::exponential,
          Encoding::median, Encoding::pseudo_linear, Encoding::inverse, Encoding::inverse_range}) {
        cameras.push_back(encoded(encoding));
        Camera along_ray = cameras.back();
        along_ray.along = Along::ray;
        if (encoding == Encoding::linear || encoding == Encoding::inverse || encoding == Encoding::inverse_range)
            cameras.push_back(along_ray);
    }
    cameras.push_back(encoded(Encoding::ray_distance, tilted(plain)));
    cameras.push_back(encoded(Encoding::logarithmic));
    cameras.back().from_near_plane = true;

    Real worst = 0;
    for (const Camera& camera : cameras)
        for (const Storage storage : {Storage::float32, Storage::uint16, Storage::uint24}) {
            const DepthForm form = depth_form(camera, storage);
            for (const double z : {0.75, 2.0, 10.0, 60.0, 99.0})
                for (const double x : {0.5, 130.5}) {
                    const auto stored = static_cast<double>(stored_depth(camera, storage, x, 90.5, z));
                    const Real back = view_depth(camera, storage, x, 90.5, stored);
                    // The stored value was rounded to double on the way: that alone is 2⁻⁵³ of it.
                    const Real step =
                        std::abs(view_depth(camera, storage, x, 90.5, std::nextafter(stored, 1e9)) - back);
                    const Real error = std::abs(back - z);
                    INFO(to_string(camera.encoding)
                         << ", " << to_string(form.form) << ", " << to_string(storage) << ", z " << z);
                    REQUIRE(error <= step + z * inverse_tolerance);
                    worst = std::max(worst, error / (step + z * inverse_tolerance));
                }
        }
    std::cout << "form: " << cameras.size() << " cameras; worst error of view_depth(stored_depth(z)) " << worst
              << " steps of a double\n";
}

TEST_CASE("form: what counts as background and as a surface", "[form]") {
    const Projection standard = perspective(edges, {0.5, 100});
    const Projection reversed = perspective(edges, {0.5, 100, DepthOrder::reversed}, Convention::direct3d());
    const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
    const auto background = [](Camera camera, Storage storage) { return depth_form(camera, storage).background; };

    REQUIRE(background(camera_of(standard), Storage::float32) == bits(1));
    REQUIRE(background(camera_of(reversed), Storage::float32) == bits(0));
    REQUIRE(background(camera_of(standard), Storage::uint16) == 65535u);
    REQUIRE(background(camera_of(reversed), Storage::uint16) == 0u);
    REQUIRE(background(camera_of(standard), Storage::uint24) == 0xffffffu);
    REQUIRE(background(camera_of(standard), Storage::float16) == 0x3c00u);

    // glDepthRange turned round stores the far plane as 0, and of a reversed projection as 1.
    Camera turned = camera_of(standard);
    turned.depth_range = {1, 0};
    REQUIRE(background(turned, Storage::float32) == bits(0));
    turned.projection = reversed;
    REQUIRE(background(turned, Storage::float32) == bits(1));
    turned.depth_range = {0.25, 0.75};
    REQUIRE(background(turned, Storage::float32) == bits(0.25f));
    REQUIRE(depth_form(turned).lowest == 0.25f);
    REQUIRE(depth_form(turned).highest == 0.75f);

    REQUIRE(background(encoded(Encoding::view_z), Storage::float32) == bits(std::numeric_limits<float>::infinity()));
    REQUIRE(background(encoded(Encoding::view_z), Storage::float16) == 0x7c00u);
    REQUIRE_FALSE(background(encoded(Encoding::view_z), Storage::uint16));
    REQUIRE(background(encoded(Encoding::inverse), Storage::float32) == bits(0));
    REQUIRE(background(encoded(Encoding::linear), Storage::uint16) == 65535u);
    // Only the window encoding is written by the reversed matrix.
    REQUIRE(background(encoded(Encoding::linear, reversed), Storage::float32) == bits(1));

    Camera told = encoded(Encoding::view_z);
    told.background = 0;
    REQUIRE(background(told, Storage::uint16) == 0u);
    told.background = 0.5;
    REQUIRE(contains(refusal([&] { depth_form(told, Storage::uint16); }), "background = 0.5 is not a uint16 code"));
    told.background = 1e10;
    REQUIRE(contains(refusal([&] { depth_form(told, Storage::float16); }), "is not a float16 value"));

    // A surface lies in front of the camera, wherever that is; orthographic rays have none.
    REQUIRE(depth_form(camera_of(standard)).least_depth == 0);
    REQUIRE(depth_form(camera_of(orthographic(edges, {-5, 5}))).least_depth == -infinity);
    Projection moved = standard;
    moved.matrix.col(3) += moved.matrix.leftCols<3>() * Point(0, 0, -3);
    REQUIRE(depth_form(camera_of(moved)).least_depth == -3);
}

TEST_CASE("form: a camera that cannot be decoded says why", "[form]") {
    const auto said = [](Camera camera, auto change) {
        change(camera);
        return refusal([&] { depth_form(camera); });
    };
    const Camera good = encoded(Encoding::window);
    REQUIRE(refusal([&] { depth_form(good); }).empty());
    const auto says = [&](auto change, const std::string& reason) {
        const std::string message = said(good, change);
        INFO("expected: " << reason << "\nsaid: " << message);
        REQUIRE(contains(message, reason));
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    says([](Camera& c) { c.width = 0; }, "0 x 121 pixels");
    says([](Camera& c) { c.depth_range = {0.5, 0.5}; }, "depth_range = [0.5, 0.5]");
    says([&](Camera& c) { c.depth_range = {nan, 1}; }, "depth_range = [nan, 1]");
    says([](Camera& c) { c.offset = 1; }, "offset is for the inverse encoding, not for the window encoding");
    says([](Camera& c) { c.along = Along::ray; }, "along = ray is for linear, inverse and inverse-range");
    says([](Camera& c) { c.from_near_plane = true; },
         "from_near_plane is for the ray-distance and logarithmic encodings");
    says([](Camera& c) { c.background = 2, c.missing = 2; }, "missing and background are both 2");
    says([&](Camera& c) { c.missing = nan; }, "missing must be a number");
    says([&](Camera& c) { c.background_from = nan; }, "background_from must be a number");
    says([](Camera& c) { c.scale = 0; }, "scale = 0 must be finite, and other than 0");
    says([](Camera& c) { c.encoding = Encoding::linear, c.near_plane.reset(); }, "the linear encoding needs near");
    says([](Camera& c) { c.encoding = Encoding::linear, c.far_plane = infinity; }, "far = inf must be finite");
    says([](Camera& c) { c.encoding = Encoding::linear, c.far_plane = c.near_plane; }, "must differ");
    says([](Camera& c) { c.encoding = Encoding::pseudo_linear, c.far_plane.reset(); },
         "the pseudo-linear encoding needs far");
    says([](Camera& c) { c.encoding = Encoding::median, c.median.reset(); }, "the median encoding needs median");
    says([](Camera& c) { c.encoding = Encoding::median, c.median = -1; }, "median = -1 must be above 0");
    says([](Camera& c) { c.encoding = Encoding::logarithmic, c.log_c = 0; }, "log_c = 0 must be above 0");
    says([](Camera& c) { c.encoding = Encoding::logarithmic, c.far_plane = 0; }, "far = 0 must be above 0");
    says([](Camera& c) { c.encoding = Encoding::exponential, c.near_plane = 0; }, "must satisfy 0 < near < far");
    says([](Camera& c) { c.projection.matrix.row(2) = c.projection.matrix.row(3); }, "the projection is singular");
}

TEST_CASE("form: logarithmic depth may begin at the near plane, as Cesium's does", "[form]") {
    Camera camera = encoded(Encoding::logarithmic);
    camera.near_plane = 0.5;
    camera.far_plane = 80; // beyond it
    camera.log_c = 2;
    camera.from_near_plane = true;
    for (const double v : {0.0, 0.1, 0.5, 1.0}) {
        const double z = 0.5 + (std::pow(2 * 80 + 1, v) - 1) / 2;
        CHECK(static_cast<double>(view_depth(camera, Storage::float32, 3, 4, v)) == Approx(z).epsilon(1e-15));
    }
    camera.near_plane.reset();
    CHECK_THROWS_WITH(depth_form(camera), ContainsSubstring("near"));
}
