// dof_masks: circles against __float128 for every form, encoding and storage; weights, sky and validity by
// definition.

#include "catch.hpp"
#include "images.hpp"
#include "judge.hpp"
#include "quad.hpp"
#include "subjects.hpp"
#include "test_device.hpp"

#include "operations/dof_masks/dof_masks.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using oracle::encoded;
using oracle::encodings;
using oracle::Quad;
using oracle::Subject;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();
constexpr double no_background = -5e30; // a stored value that no image here has

// Focus within the range of depths, at its ends, beyond them and at infinity.
std::vector<double> focuses(const Subject& subject) {
    double near = 0.1, far = 1e4;
    if (subject.frustum && subject.camera.encoding == Encoding::window) {
        near = std::abs(static_cast<double>(subject.frustum->near));
        far = std::abs(static_cast<double>(subject.frustum->far));
    }
    near = std::max(near, 1e-6);
    if (!std::isfinite(far))
        far = 1e4 * near;
    return {1.7 * near, std::sqrt(near * far), 3 * far, infinity, near};
}

// A lens whose circle is k pixels wide at infinity (perspective) or at twice the focus.
CircleOfConfusion lens_of(const Camera& camera, const DepthForm& form, double focus, double k = 20.3) {
    const bool infinite = std::isinf(focus);
    if (!form.perspective)
        return {k, infinite ? 0 : k / focus, 0, true};
    const long double centre = static_cast<long double>(camera_rays(camera).centre_depth);
    return {infinite ? 0 : k, infinite ? 1.8 * k : k * focus, centre, false};
}

// Just above and just below a power of two, where an ulp is largest and smallest against its number.
constexpr double widths[] = {20.3, 16.001, 31.999, 0.00391, 511.7};

Quad exact_circle(const CircleOfConfusion& circle, Quad z) {
    if (circle.telecentric)
        return Quad(circle.g) * z - Quad(circle.k);
    return isinfq(z) ? Quad(circle.k) : Quad(circle.k) - Quad(circle.g) / (z - Quad(circle.lens_depth));
}

struct Found {
    double worst = 0, share = 0; ///< in ulp of max(|c|, k), the condition's part taken off; of the bound
    long checked = 0;
    std::string where{};

    void print(const std::string& label) const {
        std::printf("%-44s %9ld circles  worst %.3f ulp of max(|c|, k), %.3f of the bound  %s\n", label.c_str(),
                    checked, worst, share, where.c_str());
    }
};

double condition_of(Form form, Arithmetic arithmetic) {
    if (form == Form::reciprocal)
        return 0;
    if (form == Form::ray_distance || form == Form::inverse_ray_distance)
        return sum_condition_ray_distance;
    return arithmetic == Arithmetic::fp64 ? sum_condition_fp64 : sum_condition_two_float;
}

std::string judge(const Subject& subject, const oracle::Truth& truth, const DepthForm& form,
                  const CircleOfConfusion& circle, Arithmetic arithmetic, double v, double x, double y, float got,
                  Found& error) {
    const auto fault = [&](const std::string& what) {
        std::ostringstream message;
        message << std::hexfloat << subject.name << ", v = " << v << std::defaultfloat << " at (" << x << ", " << y
                << "): " << got << " but " << what << '\n';
        return message.str();
    };
    if (form.form == Form::exponential && arithmetic == Arithmetic::two_float && v != 0 &&
        std::abs(v) < exponential_least_two_float)
        return {};
    // A denormal has so few bits that its circle misses the bound where k is 0, or next to a logarithmic camera.
    const bool is_denormal = v != 0 && std::abs(v) < 0x1p-126;
    if (is_denormal && (circle.k == 0 || form.form == Form::exponential))
        return {};
    if (!truth.in_range(v))
        return std::isnan(got) ? std::string() : fault("the value is outside the range");
    const double epsilon = condition_of(form.form, arithmetic);
    const Quad z = truth.depth(v, x, y);
    if (oracle::is_lost(v) || oracle::is_lost(z))
        return {};
    const Quad condition = epsilon == 0 ? Quad(1) : truth.condition(form.form, v, x, y);
    if (!(epsilon * condition < Quad(0.125)))
        return {}; // not even the sign is promised
    const Quad slack_z = isinfq(z) ? Quad(0) : epsilon * condition * fabsq(z) + oracle::ulp(z);
    const bool in_front = circle.telecentric || truth.in_front(z - slack_z);
    if (std::isnan(got))
        return in_front ? fault("the exact depth is " + oracle::text_of(z)) : std::string();
    if (!circle.telecentric && !truth.in_front(z + slack_z))
        return fault("the exact depth, " + oracle::text_of(z) + ", is not in front of the camera");
    const Quad exact = exact_circle(circle, z), k = Quad(circle.k);
    if (oracle::is_lost(exact))
        return {};
    const Quad terms =
        k + fabsq(circle.telecentric ? Quad(circle.g) * z : k - exact); // k and g z, or g/(z − lens_depth)
    const double unit = oracle::ulp(fabsq(exact) > k ? exact : k);
    const auto slack = isinfq(z) ? 0.0 : static_cast<double>(epsilon * condition * terms / unit);
    const double off = std::isinf(got) && fabsq(exact) > Quad(3.4e38) && (got < 0) == (exact < 0)
                           ? 0
                           : static_cast<double>(fabsq(got - exact) / unit);
    ++error.checked;
    if (slack < 1.0 / 64 && off > error.worst) {
        error.worst = off;
        error.where = subject.name;
    }
    error.share = std::max(error.share, off / (coc_ulp + slack));
    if (off <= coc_ulp + slack)
        return {};
    std::ostringstream message;
    message << "the exact circle is " << oracle::text_of(exact) << ": " << off << " ulp, allowed " << coc_ulp + slack;
    return fault(message.str());
}

std::vector<float> circles(const StoredDepth& stored, const CircleOfConfusion& coc,
                           const DofMasksOptions& options = {}) {
    return images::floats(dof_masks(stored, coc, options).coc);
}

void check(const std::string& label, const std::vector<Subject>& subjects) {
    for (const Arithmetic arithmetic : oracle::arithmetics()) {
        std::mt19937 random(11);
        Found error;
        oracle::Faults faults;
        std::array<long, 4> forms{};
        std::size_t turn = 0;
        for (Subject subject : subjects) {
            subject.camera.background = no_background;
            const oracle::Truth truth(subject, Storage::float32);
            const DepthForm form = depth_form(subject.camera);
            for (const oracle::Patch& patch : oracle::default_patches) {
                const std::vector<double> all = focuses(subject);
                const double k = widths[(turn / all.size() + turn) % std::size(widths)];
                const CircleOfConfusion circle = lens_of(subject.camera, form, all[turn++ % all.size()], k);
                ++forms[static_cast<std::size_t>(circle_form(form, circle))];
                std::vector<float> values = oracle::stored_values(subject, truth, patch, random);
                const Image image = Image::from_host(oracle::device(arithmetic), Element::f32, values.data(),
                                                     {patch.width, patch.height});
                const std::vector<float> got =
                    circles({image, subject.camera, Storage::float32, patch.x, patch.y}, circle);
                for (std::size_t i = 0; i < values.size(); ++i) {
                    const auto column = static_cast<double>(i % static_cast<std::size_t>(patch.width)),
                               row = static_cast<double>(i / static_cast<std::size_t>(patch.width));
                    faults.add(judge(subject, truth, form, circle, arithmetic, static_cast<double>(values[i]),
                                     patch.x + column + 0.5, patch.y + row + 0.5, got[i], error));
                }
            }
        }
        error.print(label + ", " + oracle::name(arithmetic));
        std::printf("%-44s %ld recentred, %ld sums, %ld quotients, %ld of depth\n", "", forms[0], forms[1], forms[2],
                    forms[3]);
        CHECK(error.checked > 1000);
        CHECK(faults.text() == "");
    }
}

Camera window_camera(int width, int height, DepthSpan span = {0.1, 100}) {
    Camera camera{
        .projection = perspective(1.0, static_cast<double>(width) / height, span), .width = width, .height = height};
    return camera;
}

const Device& cpu() {
    return oracle::device();
}

struct Planes {
    std::vector<float> circle, near, focus, far;
};

Planes download(const DofMasks& masks) {
    using images::floats;
    return {floats(masks.coc), floats(masks.near_weight), floats(masks.focus_weight), floats(masks.far_weight)};
}

Planes all_weights(const StoredDepth& stored, const CircleOfConfusion& coc, DofMasksOptions options = {}) {
    options.near_weight = options.focus_weight = options.far_weight = true;
    return download(dof_masks(stored, coc, options));
}

Planes masks_of(std::vector<float>& values, const Camera& camera, const CircleOfConfusion& coc,
                const DofMasksOptions& options = {}) {
    const Layout layout{camera.width, camera.height};
    return all_weights({Image::from_host(cpu(), Element::f32, values.data(), layout), camera}, coc, options);
}

std::string message_of(const CircleOfConfusion& coc, const DofMasksOptions& options, const Camera& camera) {
    std::vector<float> values(static_cast<std::size_t>(camera.width * camera.height), 0.5f);
    try {
        masks_of(values, camera, coc, options);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "accepted";
}

} // namespace

TEST_CASE("dof_masks: circles of every form are within their bound, whatever the camera", "[dof_masks][exact]") {
    for (const auto& [name, subjects] : oracle::families()) {
        std::vector<Subject> some; // two of five, which meet every convention, order and range
        for (std::size_t i = 0; i < subjects.size(); ++i)
            if (i % 5 < 2)
                some.push_back(subjects[i]);
        check("circles, " + name, some);
    }
}

TEST_CASE("dof_masks: circles of other encodings under orthographic rays and a moved centre are within their bound",
          "[dof_masks][exact]") {
    std::vector<Subject> subjects;
    const Eigen::Matrix4d moved = oracle::moved(oracle::perspective_matrix(0.7, 0.5, 0.1, 1e4), {1, 2, 3});
    for (const Encoding encoding : encodings) {
        subjects.push_back(encoded(oracle::named(oracle::from_orthographic({-5, 7, -4, 3}, {0.1, 1e4}),
                                                 std::string("orthographic ") + to_string(encoding)),
                                   encoding, 1));
        if (encoding != Encoding::window)
            subjects.push_back(
                encoded(oracle::named(oracle::from_matrix(moved), std::string("centre moved, ") + to_string(encoding)),
                        encoding, 1));
    }
    check("circles, encodings", subjects);
}

TEST_CASE("dof_masks: the background has exactly k, or what was asked for", "[dof_masks]") {
    const CircleOfConfusion circle{20.3, 137, 0, false};
    for (const Arithmetic arithmetic : oracle::arithmetics()) {
        std::vector<Subject> subjects;
        for (const Encoding encoding : encodings)
            subjects.push_back(encoded(encoding));
        subjects.push_back(oracle::from_field_of_view(1, 1, {0.1, infinity, DepthOrder::reversed}));
        subjects.push_back(with_oblique_near_plane(oracle::from_field_of_view(1, 1, {0.1, 100}), {0.3, 0.2, -1, -0.2}));
        for (const Subject& subject : subjects) {
            INFO(subject.name);
            const DepthForm form = depth_form(subject.camera);
            std::vector<float> values(35, std::bit_cast<float>(*form.background));
            const StoredDepth stored{Image::from_host(oracle::device(arithmetic), Element::f32, values.data(), {35, 1}),
                                     subject.camera};
            const Planes blur = all_weights(stored, circle);
            const Planes sharp = all_weights(stored, circle, {.sky = Sky::sharp});
            const Planes none = all_weights(stored, circle, {.sky = Sky::exclude});
            const Planes clamped = all_weights(stored, circle, {.max_coc_px = 8});
            for (std::size_t i = 0; i < values.size(); ++i) {
                REQUIRE(blur.circle[i] == 20.3f);
                REQUIRE((blur.near[i] == 0 && blur.focus[i] == 0 && blur.far[i] == 1));
                REQUIRE((sharp.circle[i] == 0 && sharp.near[i] == 0 && sharp.focus[i] == 1 && sharp.far[i] == 0));
                REQUIRE((std::isnan(none.circle[i]) && none.near[i] == 0 && none.focus[i] == 0 && none.far[i] == 0));
                REQUIRE(clamped.circle[i] == 8);
            }
        }
    }
    Camera orthographic_camera{.projection = orthographic({-1, 1, -1, 1}, {0, 10}), .width = 3, .height = 1};
    std::vector<float> values{1, 0.5f, 0};
    const CircleOfConfusion telecentric{.k = 20, .g = 10, .telecentric = true};
    const Planes infinite = masks_of(values, orthographic_camera, telecentric);
    CHECK(infinite.circle == std::vector<float>{HUGE_VALF, 30, -20});
    CHECK(infinite.far == std::vector<float>{1, 1, 0});
    CHECK(masks_of(values, orthographic_camera, telecentric, {.max_coc_px = 25}).circle ==
          std::vector<float>{25, 25, -20});
}

TEST_CASE("dof_masks: an invalid pixel has no circle and no weight, and nothing spreads from it", "[dof_masks]") {
    Camera camera = window_camera(7, 1);
    const CircleOfConfusion circle{20, 100, 0, false};
    std::vector<float> values{0.5f, nan_f, 1.5f, 0.5f, -0.1f, HUGE_VALF, 0.5f};
    const Planes window = masks_of(values, camera, circle);
    camera.encoding = Encoding::view_z;
    std::vector<float> depths{5, nan_f, 0, -1, -HUGE_VALF, 1e-44f, HUGE_VALF};
    const Planes metric = masks_of(depths, camera, circle);
    for (const std::size_t i : {1u, 2u, 4u, 5u})
        CHECK((std::isnan(window.circle[i]) && window.near[i] == 0 && window.focus[i] == 0 && window.far[i] == 0));
    for (const std::size_t i : {0u, 3u, 6u})
        CHECK((window.circle[i] == window.circle[0] && window.near[i] + window.focus[i] + window.far[i] == 1));
    for (const std::size_t i : {1u, 2u, 3u, 4u})
        CHECK((std::isnan(metric.circle[i]) && metric.near[i] == 0 && metric.focus[i] == 0 && metric.far[i] == 0));
    CHECK(metric.circle[0] == 0);
    CHECK(metric.circle[5] == -HUGE_VALF);
    CHECK(metric.circle[6] == 20);
    CHECK(masks_of(depths, camera, circle, {.max_coc_px = 64}).circle[5] == -64);
    for (const Encoding encoding :
         {Encoding::view_z, Encoding::ray_distance}) { // infinitely far without being the background
        camera.encoding = encoding;
        camera.background = -1;
        const Planes far = masks_of(depths, camera, circle, {.sky = Sky::exclude});
        CHECK((far.circle[6] == 20 && far.far[6] == 1));
        CHECK((std::isnan(far.circle[3]) && std::isnan(far.circle[4])));
    }
}

TEST_CASE("dof_masks: weights are the ramp of the circle and sum to exactly one", "[dof_masks]") {
    Camera camera = window_camera(4099, 3);
    camera.encoding = Encoding::view_z;
    const CircleOfConfusion circle{20, 140, 0, false};
    std::mt19937 random(3);
    std::uniform_real_distribution<float> where(-3, 3);
    std::vector<float> depths(4099 * 3);
    for (float& z : depths)
        z = 7 * std::exp2(std::abs(where(random)) < 2 ? where(random) / 16 : where(random));
    double worst = 0;
    for (const double sharp : {0.0, 0.5, 1.0, 3.0})
        for (const double transition : {0.0, 0.25, 1.0, 7.0}) {
            const Planes got = masks_of(depths, camera, circle, {.sharp_px = sharp, .transition_px = transition});
            const double allowed = 0x1p-22 + (transition > 0 ? 0x1p-24 * sharp / transition : 0);
            std::array<long, 3> kinds{};
            for (std::size_t i = 0; i < depths.size(); ++i) {
                const auto c = static_cast<double>(got.circle[i]);
                const double away = transition > 0 ? std::clamp((std::abs(c) - sharp) / transition, 0.0, 1.0)
                                                   : (std::abs(c) > sharp ? 1 : 0);
                const double off = std::max({std::abs(static_cast<double>(got.near[i]) - (c < 0 ? away : 0)),
                                             std::abs(static_cast<double>(got.far[i]) - (c > 0 ? away : 0)),
                                             std::abs(static_cast<double>(got.focus[i]) - (1 - away))});
                worst = std::max(worst, off / allowed);
                REQUIRE(off <= allowed);
                REQUIRE(got.near[i] + got.focus[i] + got.far[i] == 1.0f);
                REQUIRE(got.far[i] + got.focus[i] + got.near[i] == 1.0f);
                REQUIRE(static_cast<double>(got.near[i]) + static_cast<double>(got.focus[i]) +
                            static_cast<double>(got.far[i]) ==
                        1.0);
                REQUIRE(got.near[i] * got.far[i] == 0);
                ++kinds[away == 0 ? 0 : away == 1 ? 2 : 1];
            }
            CHECK((sharp == 0 || kinds[0] > 10));
            CHECK((transition == 0 || kinds[1] > 10));
            CHECK(kinds[2] > 10);
        }
    std::printf("weights: worst %.3f of the bound\n", worst);
}

TEST_CASE("dof_masks: some weights have the bits that they have beside the others", "[dof_masks]") {
    const Camera camera = window_camera(61, 23);
    std::vector<float> values(61 * 23);
    std::mt19937 random(4);
    for (float& value : values)
        value = static_cast<float>(random() >> 8) * 0x1p-24f;
    const CircleOfConfusion circle{20, 140, 0, false};
    const Device device = test_device({.memory_budget = 61 * 4 * 5}); // in bands
    const StoredDepth stored{Image::from_host(device, Element::f32, values.data(), {61, 23}), camera};
    const Planes all = masks_of(values, camera, circle);
    const auto same = [](const Image& image, const std::vector<float>& expected) {
        const std::vector<float> got = images::floats(image);
        return std::memcmp(got.data(), expected.data(), 4 * expected.size()) == 0;
    };
    for (int asked = 1; asked < 7; ++asked) {
        const DofMasks got = dof_masks(
            stored, circle,
            {.near_weight = (asked & 1) != 0, .focus_weight = (asked & 2) != 0, .far_weight = (asked & 4) != 0});
        INFO("weights " << asked);
        CHECK(same(got.coc, all.circle));
        CHECK(((asked & 1) != 0 ? same(got.near_weight, all.near) : !got.near_weight));
        CHECK(((asked & 2) != 0 ? same(got.focus_weight, all.focus) : !got.focus_weight));
        CHECK(((asked & 4) != 0 ? same(got.far_weight, all.far) : !got.far_weight));
    }
}

TEST_CASE("dof_masks: bad options are refused in one line", "[dof_masks]") {
    const Camera camera = window_camera(4, 3);
    const CircleOfConfusion circle{20, 140, 0, false};
    CHECK(message_of(circle, {}, camera) == "accepted");
    CHECK(message_of({-1, 1, 0, false}, {}, camera) == "circle = (-1, 1) must be two numbers from 0, k and g");
    CHECK(message_of({1, infinity, 0, false}, {}, camera) == "circle = (1, inf) must be two numbers from 0, k and g");
    CHECK(message_of({1, 1, NAN, false}, {}, camera) == "the circle's lens_depth = nan must be finite");
    CHECK(message_of({1, 1, 0, true}, {}, camera) == "a telecentric circle does not belong to a perspective camera");
    Camera orthographic_camera = camera;
    orthographic_camera.projection = orthographic({-1, 1, -1, 1}, {0, 10});
    CHECK(message_of(circle, {}, orthographic_camera) == "an orthographic camera needs a telecentric circle");
    Camera larger = camera;
    larger.width = 3; // than the image says
    std::vector<float> values(12, 0.5f);
    CHECK_THROWS_AS(dof_masks({Image::from_host(cpu(), Element::f32, values.data(), {4, 3}), larger}, circle),
                    std::invalid_argument);
    CHECK_THROWS_AS(dof_masks({Image(), camera}, circle), std::invalid_argument);
}

TEST_CASE("dof_masks: the depth under a pixel is what to focus on", "[dof_masks]") {
    Camera camera = window_camera(3, 2);
    camera.encoding = Encoding::view_z;
    std::vector<float> values{1, 2, 3, 4, HUGE_VALF, nan_f};
    const StoredDepth stored{Image::from_host(cpu(), Element::f32, values.data(), {3, 2}), camera};
    CHECK(depth_at(stored, 2, 0) == 3);
    CHECK(depth_at(stored, 0, 1) == 4);
    CHECK(depth_at(stored, 1, 1) == infinity);
    CHECK_THROWS_WITH(depth_at(stored, 2, 1), "pixel (2, 1) is invalid: it has no depth to focus on");
    CHECK_THROWS_WITH(depth_at(stored, 3, 0), "pixel = (3, 0) lies outside the image of 3 x 2");
    CHECK_THROWS_WITH(depth_at(stored, 0, -1), "pixel = (0, -1) lies outside the image of 3 x 2");
}
