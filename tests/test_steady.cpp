// A shot of relative depth whose frames have scales and offsets of their own. The oracle is the depth that they were made of: what
// keeps its distance is to keep its value.
#include "catch.hpp"

#include <fathom/relative.hpp>

#include <cmath>
#include <cstdio>
#include <random>
#include <tuple>

using namespace fathom;

namespace {

constexpr int width = 160, height = 96;
constexpr double blur_px = 24; // of --blur-px: circles for a difference of 1

/// Inverse depth of a place at a time: a floor, posts that stand, a card that crosses the picture. `pan`: pixels a frame.
double inverse_depth(double x, double y, int frame, double pan, unsigned scene) {
    const double at = x + pan * frame + 37 * scene;
    double value = 0.1 + 0.5 * y / height + 0.05 * std::sin(0.05 * at + scene);
    if (std::fmod(at, 41) < 9 && y > 20)
        value = 0.55 + 0.1 * (scene % 3);
    const double card = std::fmod(3.0 * frame + 50 * scene, width + 60.0) - 30;
    if (std::abs(x - card) < 14 && std::abs(y - 50) < 30)
        value = 0.9;
    return value;
}

struct Shot {
    std::vector<std::vector<float>> frames = {};
    std::vector<double> scales = {}, offsets = {};
    std::vector<ShotFrame> samples = {};

    /// `codes`: of 8 bits, or 0 for floats.
    Shot(int count, const std::vector<int>& cuts, double noise, int codes, double pan = 0) {
        std::mt19937 random(7);
        std::normal_distribution normal;
        unsigned scene = 0;
        for (int t = 0; t < count; ++t) {
            scene += static_cast<unsigned>(std::ranges::count(cuts, t));
            scales.push_back(std::exp(0.25 * normal(random)));
            offsets.push_back(0.1 * normal(random));
            std::vector<float>& frame = frames.emplace_back();
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    double value =
                        scales.back() * (inverse_depth(x, y, t, pan, scene) + noise * normal(random)) + offsets.back();
                    if (codes > 0)
                        value = std::clamp(std::round(codes * (0.2 + 0.35 * value)), 0.0, 255.0);
                    frame.push_back(static_cast<float>(value));
                }
            samples.push_back(shot_frame({frame.data(), width, height}));
        }
    }
};

/// How the circle of what stands still at two depths changes over frames [first, last): the root of the mean square, in pixels; and
/// how far it drifts from the first tenth of them to the last, as a part of the range.
struct Flicker {
    double jitter_px = 0, drift = 0;
};

Flicker flicker_of(const Shot& shot, const std::vector<SteadyRange>& ranges, int first, int last, int codes) {
    Flicker worst;
    for (const double inverse : {0.15, 0.6}) {
        std::vector<double> values;
        for (int t = first; t < last; ++t) {
            const auto i = static_cast<std::size_t>(t);
            double stored = shot.scales[i] * inverse + shot.offsets[i];
            if (codes > 0)
                stored = codes * (0.2 + 0.35 * stored);
            values.push_back((stored - ranges[i].least) / (ranges[i].greatest - ranges[i].least));
        }
        const auto mean = [&](std::size_t from, std::size_t to) {
            double sum = 0;
            for (std::size_t i = from; i < to; ++i)
                sum += values[i] / static_cast<double>(to - from);
            return sum;
        };
        const double middle = mean(0, values.size());
        double square = 0;
        for (const double value : values)
            square += (value - middle) * (value - middle) / static_cast<double>(values.size());
        worst.jitter_px = std::max(worst.jitter_px, blur_px * std::sqrt(square));
        const std::size_t tenth = std::max<std::size_t>(1, values.size() / 10);
        worst.drift = std::max(worst.drift, std::abs(mean(values.size() - tenth, values.size()) - mean(0, tenth)));
    }
    return worst;
}

} // namespace

TEST_CASE("steady: known scales and offsets, noise and cuts leave circles where they are") {
    constexpr double most_jitter_px = 0.1, most_drift = 0.02;
    struct Case {
        const char* name;
        int count;
        std::vector<int> cuts;
        double noise;
        int codes;
    };
    for (const auto& [name, count, cuts, noise, codes] : {Case{"floats", 240, {}, 0, 0},
                                                          {"floats with 2 % of noise", 240, {}, 0.02, 0},
                                                          {"8 bits with noise", 240, {}, 0.01, 255},
                                                          {"three shots", 150, {40, 110}, 0.01, 0}}) {
        const Shot shot(count, cuts, noise, codes);
        const std::vector<SteadyRange> ranges = steady_ranges(shot.samples);
        std::vector<int> found, ends{0};
        for (int t = 1; t < count; ++t)
            if (ranges[static_cast<std::size_t>(t)].is_first)
                found.push_back(t);
        INFO(name);
        REQUIRE(found == cuts);
        CHECK(ranges[0].is_first);
        ends.insert(ends.end(), cuts.begin(), cuts.end());
        ends.push_back(count);
        for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
            const auto [jitter_px, drift] = flicker_of(shot, ranges, ends[i], ends[i + 1], codes);
            std::printf("%s, frames %d to %d: circles off by %.3f px rms, drift %.2f %%\n", name, ends[i],
                        ends[i + 1] - 1, jitter_px, 100 * drift);
            CHECK(jitter_px <= most_jitter_px);
            CHECK(drift <= most_drift);
        }
    }
}

TEST_CASE("steady: a camera that pans is no cut") {
    for (const double pan : {0.5, 2.0}) {
        const Shot shot(120, {}, 0.005, 0, pan);
        const std::vector<SteadyRange> ranges = steady_ranges(shot.samples);
        CHECK(std::ranges::count(ranges, true, &SteadyRange::is_first) == 1);
        const auto [jitter_px, drift] = flicker_of(shot, ranges, 0, 120, 0);
        std::printf("a pan of %.1f px a frame: circles off by %.3f px rms, drift %.2f %%\n", pan, jitter_px,
                    100 * drift);
        CHECK(jitter_px <= 0.5);
        CHECK(drift <= 0.05);
    }
}

TEST_CASE("steady: ranges ascend and hold all values, whatever the frames are") {
    std::mt19937 random(3);
    std::uniform_real_distribution number(-5.0f, 5.0f);
    for (const int count : {1, 2, 3, 17}) {
        std::vector<ShotFrame> shot;
        std::vector<std::vector<float>> frames;
        for (int t = 0; t < count; ++t) {
            std::vector<float>& frame = frames.emplace_back();
            for (int i = 0; i < 35 * (1 + t % 3); ++i)
                frame.push_back(i % 11 == 0 ? std::nanf("") : number(random));
            shot.push_back(shot_frame({frame.data(), 5 * (1 + t % 3), 7}));
        }
        const std::vector<SteadyRange> ranges = steady_ranges(shot);
        REQUIRE(ranges.size() == frames.size());
        for (std::size_t t = 0; t < ranges.size(); ++t) {
            CHECK(ranges[t].least < ranges[t].greatest);
            for (const float value : frames[t])
                if (!std::isnan(value)) {
                    CHECK(static_cast<double>(value) >= ranges[t].least - 1e-6);
                    CHECK(static_cast<double>(value) <= ranges[t].greatest + 1e-6);
                }
        }
    }
    CHECK(steady_ranges({}).empty());
    const std::vector<float> same(12, 0.5f), none(12, std::nanf(""));
    CHECK_THROWS_WITH(shot_frame({same.data(), 4, 3}), ContainsSubstring("all values are the same"));
    CHECK_THROWS_WITH(shot_frame({none.data(), 4, 3}), ContainsSubstring("all values are the same"));
    CHECK_THROWS_WITH(shot_frame({}), ContainsSubstring("must have pixels"));
}

TEST_CASE("steady: a wall that fills most of the frame is no cut, and beside it cuts are found") {
    std::mt19937 random(13);
    std::normal_distribution normal;
    std::vector<ShotFrame> shot;
    std::vector<double> values;
    for (int t = 0; t < 24; ++t) {
        const double scale = std::exp(0.3 * normal(random)), offset = normal(random);
        std::vector<float> frame;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const double wall = 0.1, ramp = 0.1 + 0.9 * (y - 58) / (height - 58);
                double value = y < 58 ? wall : t < 14 ? ramp : 1.1 - ramp;
                if (std::hypot(x - (t < 14 ? 40 : 120), y - 60) < 18)
                    value = t < 14 ? 0.8 : 0.4;
                frame.push_back(static_cast<float>(scale * (value + 0.01 * normal(random)) + offset));
            }
        shot.push_back(shot_frame({frame.data(), width, height}));
        values.push_back(scale * 0.1 + offset);
    }
    const std::vector<SteadyRange> ranges = steady_ranges(shot);
    for (std::size_t t = 0; t < ranges.size(); ++t) {
        CHECK(ranges[t].is_first == (t == 0 || t == 14));
        const auto steady = [&](std::size_t i) {
            return (values[i] - ranges[i].least) / (ranges[i].greatest - ranges[i].least);
        };
        CHECK(blur_px * std::abs(steady(t) - steady(t < 14 ? 0 : 14)) < 0.2);
    }
}

TEST_CASE("steady: values far from 0, and a sky that is cut off at 0, change nothing") {
    for (const auto& [offset, step, sky] : {std::tuple{30000.0, 1.0, false}, {1e5, 0.0, false}, {0.0, 0.0, true}}) {
        std::mt19937 random(17);
        std::normal_distribution normal;
        std::vector<ShotFrame> shot;
        std::vector<double> values;
        for (int t = 0; t < 24; ++t) {
            const double scale = 60 * std::exp(0.2 * normal(random)), own = offset + 10 * normal(random);
            std::vector<float> frame;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    double value = scale * inverse_depth(x, y, t, 0, 1) + own + (sky ? 20 : 0);
                    value = step > 0 ? step * std::round(value / step) : value;
                    frame.push_back(static_cast<float>(sky && y < 36 ? 0 : value));
                }
            shot.push_back(shot_frame({frame.data(), width, height}));
            values.push_back(scale * 0.4 + own + (sky ? 20 : 0));
        }
        const std::vector<SteadyRange> ranges = steady_ranges(shot);
        double most = 0;
        const auto steady = [&](std::size_t i) {
            return (values[i] - ranges[i].least) / (ranges[i].greatest - ranges[i].least);
        };
        for (std::size_t t = 1; t < ranges.size(); ++t) {
            CHECK(!ranges[t].is_first);
            most = std::max(most, blur_px * std::abs(steady(t) - steady(0)));
        }
        std::printf("values about %.0f%s: circles off by at most %.3f px\n", offset, sky ? ", a sky at 0" : "", most);
        CHECK(most < 0.3);
    }
}
