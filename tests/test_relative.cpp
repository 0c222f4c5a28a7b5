// Relative depth: its circles against the formula, and the steps of 8 bits made smooth against the plane that made them.
#include "catch.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>
#include <fathom/relative.hpp>

using namespace fathom;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

std::vector<float> circles(std::vector<float> values, int width, const CircleOfConfusion& circle, RelativeOrder order) {
    const int height = static_cast<int>(values.size()) / width;
    const Device device = test_device();
    const Image image = Image::from_host(device, Element::f32, values.data(), {width, height});
    std::vector<float> result(values.size());
    dof_masks({image, relative_camera(width, height, order)}, circle).coc.download(result.data());
    return result;
}

/// Values of a plane from 0 to 1, and the same with the steps of 8 bits.
struct Plane {
    std::vector<float> exact, stored;
};

constexpr int width = 240, height = 180;

Plane plane(double across, double down, double start) {
    Plane result;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double v = start + across * (x + 0.5) / width + down * (y + 0.5) / height;
            result.exact.push_back(static_cast<float>(v));
            result.stored.push_back(static_cast<float>(std::round(v * 255) / 255));
        }
    return result;
}

double rms_steps(const std::vector<float>& got, const std::vector<float>& exact) {
    double sum = 0;
    for (std::size_t i = 0; i < got.size(); ++i)
        sum += std::pow(255 * (static_cast<double>(got[i]) - static_cast<double>(exact[i])), 2);
    return std::sqrt(sum / static_cast<double>(got.size()));
}

} // namespace

TEST_CASE("relative: the circle is the line through the focus, whichever end is near", "[relative]") {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<float> values{0, 1, 0.5f, not_a_number, -0.25f, 1.25f};
    while (values.size() < 67 * 5)
        values.push_back(unit(random));
    for (const RelativeOrder order : {RelativeOrder::high_is_near, RelativeOrder::low_is_near})
        for (const double blur : {0.0, 1.0, 24.5, 512.0})
            for (const double focus : {0.0, 0.25, 0.7, 1.0}) {
                const CircleOfConfusion circle = relative_circle(blur, focus, order);
                const std::vector<float> got = circles(values, 67, circle, order);
                for (std::size_t i = 0; i < values.size(); ++i) {
                    const auto v = static_cast<double>(values[i]);
                    const double expected =
                        order == RelativeOrder::high_is_near ? blur * (focus - v) : blur * (v - focus);
                    INFO("v = " << v << ", focus " << focus << ", blur " << blur << ": " << got[i]);
                    if (!(v >= 0 && v <= 1))
                        REQUIRE(std::isnan(got[i]));
                    else
                        REQUIRE(std::abs(static_cast<double>(got[i]) - expected) <= coc_ulp * 0x1p-23 * blur);
                }
            }
    CHECK_THROWS_AS(relative_circle(-1, 0.5, RelativeOrder::high_is_near), std::invalid_argument);
    CHECK_THROWS_AS(relative_circle(NAN, 0.5, RelativeOrder::high_is_near), std::invalid_argument);
    CHECK_THROWS_AS(relative_circle(1, 1.5, RelativeOrder::high_is_near), std::invalid_argument);
    CHECK_THROWS_AS(relative_circle(1, NAN, RelativeOrder::low_is_near), std::invalid_argument);
}

TEST_CASE("relative: a thin lens's circles come from its inverse depth", "[relative]") {
    Camera camera{.projection = perspective(1.0, 1.5, {0.1, 100}), .width = 300, .height = 200};
    const double focus = 3;
    const CircleOfConfusion lens = circle_of_confusion({.f_stop = 2, .focus = focus, .focal_length_mm = 50}, camera);
    const double nearest = 1, farthest = 40;
    const auto v = [&](double z) { return (1 / z - 1 / farthest) / (1 / nearest - 1 / farthest); };
    const double blur = static_cast<double>(lens.g) * (1 / nearest - 1 / farthest);
    const CircleOfConfusion line = relative_circle(blur, v(focus), RelativeOrder::high_is_near);
    for (const double z : {1.0, 1.7, 3.0, 8.0, 40.0})
        CHECK(static_cast<double>(coc_at(line, 1 - v(z))) ==
              Approx(static_cast<double>(coc_at(lens, z))).epsilon(1e-12).margin(1e-12 * blur));
}

TEST_CASE("relative: the steps of 8 bits become slopes", "[relative]") {
    double worst = 0, raw = 0, under_range = 0; // pixels
    int planes = 0;
    for (const auto& [across, down] : {std::pair{0.2, 0.0},
                                       {0.0, 0.2},
                                       {0.1, 0.07},
                                       {-0.15, 0.2},
                                       {0.5, 0.1},
                                       {0.04, -0.05},
                                       {0.8, 0.0},
                                       {0.3, 0.6},
                                       {-0.05, -0.02}}) {
        const double start = 0.05 + std::max(0.0, -across) + std::max(0.0, -down);
        const Plane truth = plane(across, down, start);
        std::vector<float> got = truth.stored;
        smooth_steps(got, width, height, 1 / 255.0);
        for (std::size_t i = 0; i < got.size(); ++i)
            REQUIRE(std::abs(got[i] - truth.stored[i]) * 255 <= 0.5f + 1e-4f);

        // Under a range the steps are the codes', too.
        constexpr double low = 51, high = 204;
        std::vector<float> codes;
        for (const float value : truth.stored)
            codes.push_back(std::round(255 * value));
        const RelativeValues ranged =
            relative_values({codes.data(), width, height}, 8, {.range = std::array{low, high}, .edges = Edges::keep});
        double sum = 0, within = 0;
        for (std::size_t i = 0; i < codes.size(); ++i)
            if (const double v = ranged.values[i]; v > 0 && v < 1) {
                const double off = low + v * (high - low) - 255 * static_cast<double>(truth.exact[i]);
                sum += off * off;
                ++within;
            }
        CHECK(sum <= 0.1 * 0.1 * within);
        under_range += within;

        worst = std::max(worst, rms_steps(got, truth.exact));
        raw += rms_steps(truth.stored, truth.exact);
        ++planes;
    }
    std::cout << "relative: slanted planes in steps of 8 bits, rms error in steps: " << raw / planes
              << " as stored, at most " << worst << " smoothed\n";
    CHECK(raw / planes > 0.28);
    CHECK(under_range > 10000);
    CHECK(worst <= 0.1);
}

TEST_CASE("relative: values from 0 to 1 stay there", "[relative]") {
    for (const auto& [across, start] : {std::pair{0.2, 0.0}, {0.2, 0.8}, {1.0, 0.0}, {-0.2, 1.0}}) {
        std::vector<float> got = plane(across, 0, start).stored;
        smooth_steps(got, width, height, 1 / 255.0);
        const auto [least, most] = std::ranges::minmax(got);
        CHECK((least >= 0 && most <= 1));
    }
    std::vector<float> ramp; // truncated codes: the first plateau is as wide as the others
    for (int i = 0; i < width * height; ++i)
        ramp.push_back(static_cast<float>(i % width / 8) / 255);
    smooth_steps(ramp, width, height, 1 / 255.0);
    CHECK(std::ranges::min(ramp) >= 0);
}

TEST_CASE("relative: edges of two steps and more stay where they are", "[relative]") {
    std::vector<float> values;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            values.push_back(static_cast<float>(x < 90 ? 100 : x < 150 ? 102 : 40) / 255);
    values[5 * width + 7] = not_a_number;
    values[6 * width + 7] = 0.3f / 255; // no code
    std::vector<float> got = values;
    smooth_steps(got, width, height, 1 / 255.0);
    for (std::size_t i = 0; i < got.size(); ++i)
        CHECK((got[i] == values[i] || (std::isnan(got[i]) && std::isnan(values[i]))));
    for (const auto& [w, h] : {std::pair{1, 1}, {1, 7}, {7, 1}}) {
        std::vector<float> thin(static_cast<std::size_t>(w * h), 0.5f);
        CHECK_NOTHROW(smooth_steps(thin, w, h, 1 / 255.0));
    }
    CHECK_THROWS_AS(smooth_steps(got, width, height + 1, 1 / 255.0), std::invalid_argument);
    CHECK_THROWS_AS(smooth_steps(got, width, height, 0), std::invalid_argument);
}

TEST_CASE("relative: a range in focus has one value, and the rest keeps its distance to it", "[relative]") {
    std::vector<float> values{0, 0.25f, 0.5f, 0.625f, 0.75f, 1, not_a_number};
    CHECK(flatten_range(values, {0.5, 0.75}) == 0.5);
    const std::vector<float> expected{0, 0.25f, 0.5f, 0.5f, 0.5f, 0.75f};
    for (std::size_t i = 0; i < expected.size(); ++i)
        CHECK(values[i] == expected[i]);
    CHECK(std::isnan(values.back()));
    CHECK_THROWS_AS(flatten_range(values, {0.5, 0.25}), std::invalid_argument);
    CHECK_THROWS_AS(flatten_range(values, {-0.5, 0.25}), std::invalid_argument);
    CHECK_THROWS_AS(flatten_range(values, {0.5, NAN}), std::invalid_argument);
}

TEST_CASE("relative: NaN and infinity touch nothing beyond an edge of two steps", "[relative][footprint]") {
    std::vector<float> clean;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            clean.push_back(static_cast<float>(std::round((x < width / 2 ? 100 : 30) + 0.11 * x + 0.07 * y)) / 255);
    std::vector<float> specials = clean;
    std::mt19937 random(5);
    for (const float special : {not_a_number, INFINITY, -INFINITY})
        for (int i = 0; i < 40; ++i) {
            const auto x = i % 4 ? static_cast<int>(random() % (width / 2)) : width / 2 - 1; // some right at the edge
            specials[random() % height * width + static_cast<std::size_t>(x)] = special;
        }
    std::vector<float> got = specials, expected = clean;
    smooth_steps(got, width, height, 1 / 255.0);
    smooth_steps(expected, width, height, 1 / 255.0);
    int beside = 0;
    for (std::size_t i = 0; i < got.size(); ++i)
        if (!std::isfinite(specials[i]))
            REQUIRE(std::bit_cast<std::uint32_t>(got[i]) == std::bit_cast<std::uint32_t>(specials[i]));
        else if (i % width >= width / 2)
            REQUIRE(got[i] == expected[i]);
        else {
            REQUIRE(std::abs(got[i] - clean[i]) * 255 <= 0.5f + 1e-4f);
            beside += got[i] != expected[i];
        }
    CHECK(beside > 0);

    got = specials;
    flatten_range(got, {0.25, 0.5});
    flatten_range(clean, {0.25, 0.5});
    for (std::size_t i = 0; i < got.size(); ++i)
        REQUIRE(std::bit_cast<std::uint32_t>(got[i]) ==
                std::bit_cast<std::uint32_t>(std::isfinite(specials[i]) ? clean[i] : specials[i]));
}

TEST_CASE("relative: stored values become 0 to 1, of the picture's size, with one value in focus", "[relative]") {
    constexpr int wide = 12, high = 8, scale = 3;
    const auto value = [](int x, int y) { return 3.0 + 2.0 * x + 5.0 * y; }; // 3 to 60
    std::vector<float> floats, grey;
    for (int y = 0; y < high; ++y)
        for (int x = 0; x < wide; ++x) {
            floats.push_back(static_cast<float>(value(x, y)));
            grey.insert(grey.end(), {floats.back(), floats.back(), floats.back(), 0.5f}); // an alpha does not count
        }
    const HostFloats stored{floats.data(), wide, high};
    const RelativeValues own = relative_values(stored, 32), codes = relative_values(stored, 16),
                         given = relative_values({grey.data(), wide, high, 4}, 32, {.range = std::array{13.0, 33.0}}),
                         flat = relative_values(stored, 32, {.focus_range = FocusRange{0.25, 0.5}});
    for (int y = 0; y < high; ++y)
        for (int x = 0; x < wide; ++x) {
            const auto i = static_cast<std::size_t>(y * wide + x);
            const double v = (value(x, y) - 3) / 57;
            CHECK(std::abs(static_cast<double>(own.values[i]) - v) < 1e-7);
            CHECK(std::abs(static_cast<double>(codes.values[i]) - value(x, y) / 65535) < 1e-9);
            CHECK(std::abs(static_cast<double>(given.values[i]) - std::clamp((value(x, y) - 13) / 20, 0.0, 1.0)) <
                  1e-7);
            CHECK(std::abs(static_cast<double>(flat.values[i]) - (v > 0.5 ? v - 0.25 : std::min(v, 0.25))) < 1e-7);
        }
    CHECK((own.doubts.empty() && codes.doubts.size() == 1));
    CHECK(codes.doubts.front() == "its values take 0.087 % of what 16 bits hold, so that little is blurred; say with "
                                  "relative_range which codes are nearest and farthest");

    // A frame of one value has a place if it has codes or a range. Otherwise it is in focus.
    const std::vector<float> one(wide * high, 51);
    for (const auto& [bits, options, v, doubts] : {std::tuple{8, RelativeOptions{}, 0.2, 1},
                                                   {8, {.range = std::array{11.0, 61.0}}, 0.8, 0},
                                                   {32, {}, 0.0, 1},
                                                   {32, {.range = std::array{11.0, 61.0}}, 0.8, 0},
                                                   {32, {.focus_range = FocusRange{0.25, 0.5}}, 0.25, 1},
                                                   {8, {.focus_range = FocusRange{0.25, 0.5}}, 0.2, 1}}) {
        const RelativeValues made = relative_values({one.data(), wide, high}, bits, options);
        CHECK(std::ranges::all_of(made.values,
                                  [&](float value) { return std::abs(static_cast<double>(value) - v) < 1e-7; }));
        CHECK(static_cast<int>(made.doubts.size()) == doubts);
        CHECK((made.doubts.empty() || made.doubts.front().starts_with("all its values are the same")));
    }

    const std::vector<float> light(3 * wide * scale * high * scale, 0.4f);
    const HostFloats color{light.data(), wide * scale, high * scale, 3};
    const RelativeValues fine = relative_values(stored, 32, {}, color);
    REQUIRE((fine.width == wide * scale && fine.height == high * scale));
    for (int y = 2 * scale; y < (high - 2) * scale; ++y) // a plane stays one
        for (int x = 2 * scale; x < (wide - 2) * scale; ++x) {
            const double v = (2 * ((x + 0.5) / scale - 0.5) + 5 * ((y + 0.5) / scale - 0.5)) / 57;
            CHECK(std::abs(static_cast<double>(fine.values[static_cast<std::size_t>(y * fine.width + x)]) - v) < 1e-6);
        }

    const auto refused = [&](const HostFloats& image, int bits, const RelativeOptions& options,
                             const HostFloats& picture, const std::string& why) {
        CHECK_THROWS_WITH(relative_values(image, bits, options, picture), ContainsSubstring(why));
    };
    const std::vector<float> unknown(16, NAN);
    refused({unknown.data(), 4, 4}, 32, {}, {}, "no value that is a number");
    refused(stored, 12, {}, {}, "bits = 12");
    refused(stored, 32, {.range = std::array{2.0, 2.0}}, {}, "the lesser one");
    refused(stored, 32, {.range = std::array{2.0, HUGE_VAL}}, {}, "must be finite");
    refused(stored, 32, {}, {light.data(), 20, 20, 3}, "same ratio of width to height");
    refused({floats.data(), wide / 2, high, 2}, 32, {}, {}, "has 2 channels");
    refused({floats.data(), wide / 3, high, 3}, 32, {}, {}, "has colours, as at pixel (0, 0)");
}

TEST_CASE("relative: arguments of a lens make the circle, and the depth grows by pixels", "[relative]") {
    const std::vector<float> values{0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.9f};
    for (const RelativeOrder order : {RelativeOrder::high_is_near, RelativeOrder::low_is_near}) {
        const StoredDepth stored{Image::from_host(test_device(), Element::f32, values.data(), {3, 2}),
                                 relative_camera(3, 2, order)};
        const double sign = order == RelativeOrder::high_is_near ? 1 : -1;
        const auto check = [&](const LensArguments& lens, double focus) {
            std::vector<float> got(values.size());
            dof_masks(stored, circle_for(completed(lens, {}, stored.camera.projection), stored))
                .coc.download(got.data());
            for (std::size_t i = 0; i < got.size(); ++i)
                CHECK(std::abs(static_cast<double>(got[i]) - sign * 20 * (focus - static_cast<double>(values[i]))) <
                      1e-5);
        };
        check({.focus_at = LensArguments::Pixel{1, 1}, .relative = order, .blur_px = 20}, 0.5);
        check({.relative = order, .blur_px = 20, .focus_range = std::array{0.25, 0.75}}, 0.25);
        std::vector<float> grown(values.size()), kept = grown;
        repaired(stored, {.grow_foreground = 1}).image.download(grown.data());
        repaired(stored, {}).image.download(kept.data());
        const bool falls = order == RelativeOrder::high_is_near;
        CHECK((kept == values && grown == (falls ? std::vector{0.4f, 0.5f, 0.9f, 0.5f, 0.9f, 0.9f}
                                                 : std::vector{0.1f, 0.1f, 0.2f, 0.1f, 0.2f, 0.3f})));
    }
    const auto refused = [](const LensArguments& lens, const char* why) {
        CHECK_THROWS_WITH(completed(lens, {}, orthographic({0, 1, 0, 1}, {0, 1})), ContainsSubstring(why));
    };
    refused({.relative = RelativeOrder::low_is_near}, "blur_px: missing");
    refused({.relative = RelativeOrder::low_is_near, .blur_px = 3}, "focus_at: missing");
    refused({.f_stop = 2, .relative = RelativeOrder::low_is_near}, "exclude each other");
}
