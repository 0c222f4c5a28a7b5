// Kernels that could do more than a camera needs give what those give that the library builds: each within its own form's
// promise of the exact depth, and the same bits where the additional terms are zeros and ones.

#include "catch.hpp"
#include "forms.hpp"
#include "judge.hpp"
#include "quad.hpp"
#include "subjects.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>

using namespace fathom;
using oracle::Patch;
using oracle::Subject;

namespace {

constexpr Patch patch{5003, 16384 - 10, 41, 10};

std::vector<Subject> cameras() {
    std::vector<Subject> subjects = oracle::everywhere("perspective", [](DepthSpan span, Convention convention) {
        return oracle::from_field_of_view(1.1, 1.5, span, convention);
    });
    const auto add = [&](const std::vector<Subject>& more) {
        subjects.insert(subjects.end(), more.begin(), more.end());
    };
    add(oracle::everywhere("oblique", [](DepthSpan span, Convention convention) {
        return oracle::oblique_perspective({0.1, -0.2, -1, -2}, span, convention);
    }));
    for (const auto& [name, convention] : oracle::conventions) {
        for (const DepthOrder order : oracle::orders) {
            for (const auto& [near, far] : {std::pair{0.1, 1e8}, {-5.0, 20.0}, {1e-6, 1e3}, {-1e4, 1e4}}) {
                const DepthSpan span{near, far, order};
                add({oracle::named(oracle::from_orthographic({-5, 7, -4, 3}, span, convention),
                                   oracle::text_of("orthographic", name, span)),
                     oracle::oblique_orthographic({0.3, -0.2, -1, -2}, span, name, convention)});
            }
        }
    }
    const Eigen::Matrix4d matrix = oracle::perspective_matrix(0.7, 0.5, 0.1, 1e4);
    add({oracle::named(oracle::from_matrix(oracle::tilted(matrix, 0.2, -0.1)), "tilted"),
         oracle::named(oracle::from_matrix(oracle::moved(matrix, {0.3, 0.1, -0.2})), "eye moved")});
    for (Subject subject : oracle::of_every_encoding()) {
        for (const std::array<double, 2> range : {std::array{0.0, 1.0}, {1.0, 0.0}, {-1.0, 0.25}}) {
            subject.camera.depth_range = range;
            add({subject});
        }
    }
    return subjects;
}

/// Stored values of a patch, and an image for what becomes of them.
struct Images {
    std::vector<float> values;
    StoredDepth stored;
    Image result;
};

Images images_of(const Subject& subject, const oracle::Truth& truth, std::mt19937& random, Arithmetic arithmetic,
                 int channels) {
    const Device& device = oracle::device(arithmetic);
    Images images{oracle::stored_values(subject, truth, patch, random), {}, {}};
    const Image image = Image::from_host(device, Element::f32, images.values.data(), {patch.width, patch.height});
    images.stored = {image, subject.camera, Storage::float32, patch.x, patch.y};
    images.result = Image(device, Element::f32, {patch.width, patch.height, channels});
    return images;
}

std::vector<float> pixels(const Image& image) {
    std::vector<float> values(static_cast<std::size_t>(image.width() * image.height() * image.channels()));
    image.download(values.data());
    return values;
}

std::size_t same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    std::size_t same = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        same += std::bit_cast<std::uint32_t>(a[i]) == std::bit_cast<std::uint32_t>(b[i]) ||
                (std::isnan(a[i]) && std::isnan(b[i]));
    return same;
}

/// What was found of one kernel in place of another.
struct Kind {
    int cameras = 0;
    std::size_t values = 0, same = 0;
    oracle::Worst worst = {};
};

void judge(const Subject& subject, const oracle::Truth& truth, Form form, Arithmetic arithmetic,
           const std::vector<float>& values, const std::vector<float>& depth, oracle::Worst& worst,
           oracle::Faults& faults) {
    const oracle::Promise promise = oracle::promise(form, arithmetic);
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const auto column = static_cast<int>(i % patch.width), row = static_cast<int>(i / patch.width);
        faults.add(oracle::judge(subject, truth, form, promise, static_cast<double>(values[i]), patch.x + column + 0.5,
                                 patch.y + row + 0.5, depth[i], worst));
    }
}

/// How far two circles are apart, in ulp of |c| + k.
double in_ulp(float a, float b, double k) {
    if (std::isnan(a) && std::isnan(b))
        return 0;
    if (std::isnan(a) || std::isnan(b))
        return std::numeric_limits<double>::infinity();
    if (a == b)
        return 0;
    return std::abs(static_cast<double>(a) - static_cast<double>(b)) /
           oracle::quick_ulp(std::abs(static_cast<double>(a)) + k);
}

/// What the condition of a quotient of sums allows, in ulp of the sums' terms; no end of it beyond the largest float, which the
/// law that decodes the depth first knows as infinite.
double condition_in_ulp(const oracle::Truth& truth, Arithmetic arithmetic, float v, std::size_t at) {
    const double epsilon = oracle::promise(Form::rational, arithmetic).condition;
    const double x = patch.x + static_cast<double>(at % patch.width) + 0.5;
    const double y = patch.y + static_cast<double>(at / patch.width) + 0.5;
    if (fabsq(truth.depth(static_cast<double>(v), x, y)) > oracle::Quad(3.4e38))
        return std::numeric_limits<double>::infinity();
    return epsilon * static_cast<double>(truth.condition(Form::rational, static_cast<double>(v), x, y)) * 0x1p24;
}

} // namespace

TEST_CASE("forms: a wider kernel decodes every camera as the one that it needs", "[forms][linearize][exact]") {
    std::mt19937 random(20261);
    const std::vector<Subject> subjects = cameras();
    for (const Arithmetic arithmetic : {Arithmetic::fp64, Arithmetic::two_float}) {
        std::map<std::string, Kind> kinds;
        oracle::Faults faults;
        for (const Subject& subject : subjects) {
            const oracle::Truth truth(subject, Storage::float32);
            const Images images = images_of(subject, truth, random, arithmetic, 1);
            const bench::Model least = bench::least_model(subject.camera);
            bench::linearize_as(least, images.stored, images.result);
            const std::vector<float> depth = pixels(images.result);
            linearize(images.stored, images.result, {Background::decode});
            REQUIRE(same_bits(depth, pixels(images.result)) == depth.size()); // it is what the library builds
            for (const bench::Model& wider : bench::wider_models(least)) {
                bench::linearize_as(wider, images.stored, images.result);
                const std::vector<float> got = pixels(images.result);
                Kind& kind = kinds[least.name + " by " + wider.name];
                ++kind.cameras;
                kind.values += got.size();
                kind.same += same_bits(depth, got);
                judge(subject, truth, wider.form.form, arithmetic, images.values, got, kind.worst, faults);
                INFO(subject.name << ", " << least.name << " by " << wider.name);
                if (wider.form.form == least.form.form)
                    REQUIRE(same_bits(depth, got) == got.size());
            }
        }
        for (const auto& [name, kind] : kinds) {
            std::cout << "forms, " << oracle::name(arithmetic) << ": " << name << ", " << kind.cameras
                      << " cameras: " << 100.0 * static_cast<double>(kind.same) / static_cast<double>(kind.values)
                      << " % the same bits; worst " << kind.worst.ulps << " ulp, " << kind.worst.share
                      << " of its bound\n";
        }
        CHECK(kinds.size() >= 10);
        CHECK(faults.text() == "");
    }
}

TEST_CASE("forms: rays that cover a depth of one a step may each have a depth of their own", "[forms][unproject]") {
    std::mt19937 random(20262);
    int checked = 0;
    for (const Arithmetic arithmetic : {Arithmetic::fp64, Arithmetic::two_float}) {
        for (const Subject& subject : cameras()) {
            const bench::Model least = bench::least_model(subject.camera);
            if (subject.camera.encoding != Encoding::window || !least.rays.w_is_depth || least.rays.eye_depth != 0)
                continue; // w is z itself only if the eye lies at depth 0
            const oracle::Truth truth(subject, Storage::float32);
            const Images images = images_of(subject, truth, random, arithmetic, 3);
            const Image inverse_depth(images.result.device(), Element::f32, {patch.width, patch.height});
            const auto run = [&](const bench::Model& model) {
                bench::unproject_as(model, images.stored, images.result);
                bench::inverse_depth_as(model, images.stored, inverse_depth);
                return std::pair{pixels(images.result), pixels(inverse_depth)};
            };
            const auto [positions, depths] = run(least);
            const auto [wider_positions, wider_depths] = run(bench::with_depth_of_each_ray(least));
            INFO(subject.name);
            REQUIRE(same_bits(positions, wider_positions) == positions.size());
            REQUIRE(same_bits(depths, wider_depths) == depths.size());
            ++checked;
        }
    }
    std::cout << "forms: rays of " << checked << " cameras, the same bits\n";
    CHECK(checked >= 200);
}

TEST_CASE("forms: wider laws of the circle of confusion agree with the one that a camera needs", "[forms][dof_masks]") {
    std::mt19937 random(20263);
    for (const Arithmetic arithmetic : {Arithmetic::fp64, Arithmetic::two_float}) {
        double worst = 0;
        int pairs = 0, beyond = 0;
        for (const Subject& subject : cameras()) {
            const DepthForm form = depth_form(subject.camera);
            const double length = std::isfinite(form.highest) ? subject.camera.near.value_or(1) : 1;
            const CircleOfConfusion circle = form.perspective ? CircleOfConfusion{.k = 20, .g = 20 * length}
                                                              : CircleOfConfusion{.k = 20, .g = 4, .telecentric = true};
            const oracle::Truth truth(subject, Storage::float32);
            const Images images = images_of(subject, truth, random, arithmetic, 1);
            const std::vector<bench::CircleModel> models = bench::circle_models(subject.camera, circle);
            bench::circle_as(models[0], circle, images.stored, images.result);
            const std::vector<float> circles = pixels(images.result);
            for (std::size_t i = 1; i < models.size(); ++i, ++pairs) {
                bench::circle_as(models[i], circle, images.stored, images.result);
                const std::vector<float> wider = pixels(images.result);
                for (std::size_t at = 0; at < wider.size(); ++at) {
                    const double apart = in_ulp(circles[at], wider[at], static_cast<double>(circle.k));
                    if (apart <= 2 * coc_ulp) { // each may be off by half of that
                        worst = std::max(worst, apart);
                        continue;
                    }
                    const double slack = 2 * condition_in_ulp(truth, arithmetic, images.values[at], at);
                    INFO(subject.name << ", " << models[0].name << " by " << models[i].name << ": " << circles[at]
                                      << ", " << wider[at] << " of " << images.values[at]);
                    REQUIRE((slack > 0x1p20 || apart <= 2 * coc_ulp + slack));
                    ++beyond;
                }
            }
        }
        std::cout << "forms, " << oracle::name(arithmetic) << ": " << pairs << " laws of the circle, at most " << worst
                  << " ulp of |c| + k apart, allowed " << 2 * coc_ulp << "; " << beyond
                  << " within their condition only\n";
        CHECK(100 * beyond < pairs * patch.width * patch.height); // stored values crowd where sums cancel
        CHECK(pairs > 200);
    }
}
