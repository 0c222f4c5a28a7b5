// Cameras and stored values at the edges of what can be decoded: what is still exact, what is refused, and where one
// turns into the other.

#include "catch.hpp"
#include "seen.hpp"
#include "stability.hpp"

#include "camera/matrix.hpp"

#include <fathom/precision.hpp>

using namespace fathom;
using namespace fathom::stability;
using oracle::Quad;
using oracle::Subject;
using seen::refusal;

namespace {

/// What the oracle says of an image: what is wrong, and how many pixels were surfaces.
struct Judged {
    std::string faults;
    oracle::Worst worst;
    int surfaces = 0, nothing = 0;
};

/// Decodes stored values, one after another, at the pixels of a patch.
Judged judged(const Subject& subject, const std::vector<float>& values, Arithmetic arithmetic, oracle::Patch patch) {
    const oracle::Truth truth(subject, Storage::float32);
    const Form form = depth_form(subject.camera).form;
    const Device& device = oracle::device(arithmetic);
    const Layout layout{patch.width, patch.height};
    const auto size = static_cast<std::size_t>(patch.width * patch.height);
    std::vector<float> stored(size), depth(size);
    for (std::size_t i = 0; i < size; ++i)
        stored[i] = values[(i * 7) % values.size()];
    const Image source = Image::from_host(device, Element::f32, stored.data(), layout);
    const Image result = Image::onto_host(device, Element::f32, depth.data(), layout);
    linearize({source, subject.camera, Storage::float32, patch.x, patch.y}, result, {Background::decode});
    result.download(depth.data());

    Judged verdict;
    oracle::Faults faults;
    for (std::size_t i = 0; i < size; ++i) {
        const double x = patch.x + static_cast<double>(i % static_cast<std::size_t>(patch.width)) + 0.5;
        const double y = patch.y + static_cast<double>(i / static_cast<std::size_t>(patch.width)) + 0.5;
        ++(std::isnan(depth[i]) ? verdict.nothing : verdict.surfaces);
        faults.add(oracle::judge(subject, truth, form, oracle::promise(form, arithmetic),
                                 static_cast<double>(stored[i]), x, y, depth[i], verdict.worst));
    }
    verdict.faults = faults.text();
    return verdict;
}

// Stored values over the whole range and crowded at both of its ends.
std::vector<float> over_the_range() {
    std::vector<float> values{0, 1};
    for (int i = 1; i < 128; ++i)
        values.push_back(static_cast<float>(i) / 128);
    for (int i = 8; i <= 24; ++i) {
        values.push_back(std::ldexp(1.0f, -i));
        values.push_back(1 - std::ldexp(1.0f, -i));
        values.push_back(std::nextafter(1 - std::ldexp(1.5f, -i), 1.0f));
    }
    return values;
}

/// All pixels of a subject's four corners and its middle, by both arithmetics. Returns what is wrong.
std::string faults_of(const Subject& subject, oracle::Worst& worst) {
    const Camera& camera = subject.camera;
    const int w = 37, h = 5;
    std::string faults;
    for (const Arithmetic arithmetic : oracle::arithmetics())
        for (const auto& [x, y] :
             {std::pair{0, 0}, std::pair{camera.width - w, 0}, std::pair{0, camera.height - h},
              std::pair{camera.width - w, camera.height - h}, std::pair{camera.width / 2, camera.height / 2 - 3}}) {
            const Judged verdict = judged(subject, over_the_range(), arithmetic, {x, y, w, h});
            faults += verdict.faults;
            worst.add(verdict.worst);
        }
    return faults;
}

} // namespace

// C·Q of a plane that leaves this share of the distance to the far corner, and precision there, which falls as it does.
TEST_CASE("stability: an oblique plane that grazes a frustum corner", "[stability]") {
    const Eigen::Vector3d normal = Eigen::Vector3d(0.3, 0.2, -1).normalized();
    const double far = 100, slope = std::tan(0.5);
    const Eigen::Vector3d corner(1.5 * slope * far, slope * far, -far); // where the plane reaches farthest inside
    const auto with_share = [&](double share) {
        const double d = -normal.dot(corner) * (1 - share);
        return oracle::named(oracle::with_oblique_near_plane(oracle::from_field_of_view(1.0, 1.5, {0.1, far}),
                                                             {normal.x(), normal.y(), normal.z(), d}),
                             "grazing", 96, 64);
    };
    for (const double share : {1e-1, 1e-3, 1e-6, 1e-9, 1e-12}) {
        INFO("share " << share);
        const Subject subject = with_share(share);
        oracle::Worst worst;
        CHECK(faults_of(subject, worst) == "");
        // Between the plane and the corner, on the corner's own ray: stored inside the range, with a finite precision.
        const double z = far * (1 - share / 2);
        const double stored = static_cast<double>(stored_depth(subject.camera, Storage::float32, 96, 0, z));
        const double spacing = depth_spacing(subject.camera, DepthBits::d24, 96, 0, z);
        std::printf("share %.0e: stored %.6f, D24 spacing at the corner %.2e, worst %.2f ulp\n", share, stored, spacing,
                    worst.ulps);
        CHECK(stored > 0);
        CHECK(stored < 1);
        CHECK(std::isfinite(spacing));
        CHECK((spacing > 0 || share < 1e-10)); // below that the difference is less than a long double can hold
        CHECK(spacing < far * share);          // two surfaces in what is left can be told apart
        CHECK(attainable_depth(subject.camera, 96, 0) == Approx(far).epsilon(1e-6));
    }
    for (const double share : {-1e-12, -1e-6, -1.})
        CHECK(contains(refusal([&] { with_share(share); }), "leaves nothing of the view volume"));
}

TEST_CASE("stability: an oblique plane that passes near the camera centre", "[stability]") {
    const auto with_distance = [](double distance) {
        return oracle::named(oracle::with_oblique_near_plane(oracle::from_field_of_view(1.0, 1.5, {0.1, 100}),
                                                             {0.1, 0.2, -1, -distance}),
                             "near the camera centre", 96, 64);
    };
    for (const double distance : {1e-1, 1e-4, 1e-8, 1e-12, 1e-30}) {
        INFO("distance " << distance);
        const Subject subject = with_distance(distance);
        oracle::Worst worst;
        CHECK(faults_of(subject, worst) == "");
        // What it costs is precision: a surface at 1 is stored 1/distance away from the plane's own 0.
        const double spacing = depth_spacing(subject.camera, DepthBits::d32f, 48, 32, 1);
        std::printf("plane %.0e from the camera centre: worst %.2f ulp, D32F spacing at z = 1: %.1e\n", distance,
                    worst.ulps, spacing);
        CHECK(spacing > 0.1 * std::min(1.0, 0x1p-24 / distance));
        CHECK((distance < 1e-6 || spacing < 10 * 0x1p-24 / distance));
    }
    CHECK(contains(refusal([&] { with_distance(0); }), "the camera centre is on the kept side"));
    CHECK(contains(refusal([&] { with_distance(-1e-12); }), "the camera centre is on the kept side"));
}

TEST_CASE("stability: an orthographic oblique plane may have the origin on its kept side", "[stability]") {
    const Eigen::Vector4d plane(0.3, -0.2, -1, 2); // C_w > 0: keeps points up to 2 behind the origin
    for (const DepthSpan span : {DepthSpan{-3, 100}, DepthSpan{-50, -1}, DepthSpan{0, 100, DepthOrder::reversed}}) {
        const Subject subject = oracle::named(
            oracle::with_oblique_near_plane(oracle::from_orthographic({-4, 4, -3, 3}, span), plane), "C_w > 0", 96, 64);
        oracle::Worst worst;
        CHECK(faults_of(subject, worst) == "");
        const Judged verdict = judged(subject, {0.25f}, oracle::widest(), {0, 0, 96, 64});
        CHECK(verdict.surfaces == 96 * 64); // depths of any sign are surfaces
    }
    CHECK(contains(refusal([&] {
                       with_oblique_near_plane(perspective(1.0, 1.5, {0.1, 100}), plane);
                   }),
                   "the camera centre is on the kept side"));
}

TEST_CASE("stability: stored depth exactly 0 and 1, one ulp inside and one outside", "[stability]") {
    const float below_one = std::nextafter(1.0f, 0.0f), above_one = std::nextafter(1.0f, 2.0f);
    const float denormal = std::numeric_limits<float>::denorm_min();
    const std::vector<float> stored{0.0f, -0.0f, denormal, -denormal, 1.0f, below_one, above_one};
    for (const Arithmetic arithmetic : oracle::arithmetics())
        for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed}) {
            const bool reversed = order == DepthOrder::reversed;
            for (const Projection& p :
                 {perspective(1.0, 1.5, {2, 64, order}), orthographic({-1, 1, -1, 1}, {2, 64, order})}) {
                INFO((reversed ? "reversed " : "")
                     << (p.is_perspective() ? "perspective " : "orthographic ") << oracle::name(arithmetic));
                const auto z = decoded(camera_of(p), stored, Storage::float32, Background::inf, arithmetic);
                const float near = 2, far = 64;
                CHECK(z[0] == (reversed ? infinity : near));
                CHECK(z[1] == (reversed ? infinity : near)); // −0 is 0
                CHECK(z[2] == (reversed ? far : near));      // 1e-45 of the range away
                CHECK(std::isnan(z[3]));
                CHECK(z[4] == (reversed ? near : infinity));
                CHECK(std::isfinite(z[5]));
                CHECK((reversed ? z[5] >= near : z[5] < far)); // the step at 1 is far/near · 2⁻²⁴: seen at far only
                CHECK(std::isnan(z[6]));
                const auto kept = decoded(camera_of(p), stored, Storage::float32, Background::decode, arithmetic);
                CHECK(kept[reversed ? 0 : 4] == far);
                const auto none = decoded(camera_of(p), stored, Storage::float32, Background::nan, arithmetic);
                CHECK(std::isnan(none[reversed ? 0 : 4]));
            }
        }
}

TEST_CASE("stability: an infinite far plane at its own stored value", "[stability]") {
    for (const Arithmetic arithmetic : oracle::arithmetics())
        for (const DepthOrder order : {DepthOrder::standard, DepthOrder::reversed}) {
            Camera camera = camera_of(perspective(1.0, 1.5, {0.1, HUGE_VAL, order}, Convention::direct3d()));
            const float far = order == DepthOrder::reversed ? 0.0f : 1.0f;
            const auto at = [&](float stored, Background background) {
                return decoded(camera, std::vector<float>{stored}, Storage::float32, background, arithmetic)[0];
            };
            CHECK(at(far, Background::inf) == infinity);
            CHECK(at(far, Background::decode) == infinity);
            CHECK(std::isnan(at(far, Background::nan)));
            camera.background = 0.5;
            CHECK(at(0.5f, Background::inf) == infinity);
            CHECK(at(far, Background::inf) == infinity); // the pole, though it is no background any more
            CHECK(at(far, Background::nan) == infinity);
            CHECK(std::isnan(at(0.5f, Background::nan)));
            // A tilted near plane puts the pole somewhere else in every pixel; beyond it there is nothing.
            camera.background.reset();
            camera.projection = with_oblique_near_plane(camera.projection, {0.2, 0.1, 1, -3});
            CHECK(at(far, Background::inf) == infinity);
            CHECK(!(at(far, Background::decode) < 0));
        }
}

TEST_CASE("stability: nearly singular matrices on both sides of the refusal", "[stability]") {
    // x and y that differ by epsilon only: no scaling of rows and columns helps, the condition is about 4/epsilon.
    const auto matrix = [](double epsilon) {
        Eigen::Matrix4d m = oracle::perspective_matrix(1, 1, 1, 100);
        m.topLeftCorner<2, 2>() << 1, 1, 1, 1 + epsilon;
        return m;
    };
    double accepted = 1, refused = 1e-15;
    REQUIRE(refusal([&] { from_matrix(matrix(accepted)); }) == "");
    REQUIRE(refusal([&] { from_matrix(matrix(refused)); }) != "");
    while (accepted / refused > 1.0001) {
        const double middle = std::sqrt(accepted * refused);
        (refusal([&] { from_matrix(matrix(middle)); }).empty() ? accepted : refused) = middle;
    }
    const std::string said = refusal([&] { from_matrix(matrix(refused)); });
    const std::string number = said.substr(said.find("number is ") + 10);
    std::printf("refused below epsilon = %.3e: %s\n", refused, said.c_str());
    CHECK(std::strtod(number.c_str(), nullptr) >= static_cast<double>(largest_condition));
    CHECK(std::strtod(number.c_str(), nullptr) < 1.01 * static_cast<double>(largest_condition));

    // Still decoded exactly on the accepted side; so is the pair depth–w at the same distance from singular.
    Eigen::Matrix4d flat = oracle::perspective_matrix(1, 1, 1, 100);
    flat.row(2) = flat.row(3) + 4 / static_cast<double>(largest_condition) * Eigen::RowVector4d(0.3, 0.2, 0, -1);
    for (const Eigen::Matrix4d& m : {matrix(accepted), flat}) {
        const std::string refused_flat = refusal([&] {
            const Subject subject = oracle::named(oracle::from_matrix(m), "nearly singular", 96, 64);
            oracle::Worst worst;
            CHECK(faults_of(subject, worst) == "");
            worst.print("nearly singular");
        });
        CHECK((refused_flat.empty() || contains(refused_flat, "condition number")));
    }
}
