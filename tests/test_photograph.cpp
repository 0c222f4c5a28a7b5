// Photographs and their depth: highlights by their formula; depth along edges against planes and steps that are known.

#include "catch.hpp"

#include <fathom/photograph.hpp>

using namespace fathom;

namespace {

HostFloats floats_of(const std::vector<float>& values, int width, int height, int channels) {
    return {values.data(), width, height, channels};
}

} // namespace

TEST_CASE("photograph: highlights grow smoothly to their peak, and an alpha stays", "[photograph]") {
    std::vector<float> light{1, 1, 1, 0.5f, 0.97f, 0.2f, 0, 1, 0.985f, 0.5f, 0.1f, 1, 2, 0, 0, 1};
    const std::vector<float> before = light;
    restore_highlights(light, 4, 3);
    const double half = 1 + 2 * 0.25;
    const double gains[] = {3, 1, half, 3};
    for (std::size_t i = 0; i < light.size(); ++i) {
        const double gain = i % 4 == 3 ? 1 : gains[i / 4];
        CHECK(std::abs(static_cast<double>(light[i]) - gain * static_cast<double>(before[i])) < 1e-5);
    }
    CHECK_THROWS_AS(restore_highlights(light, 4, 0.5), std::invalid_argument);
    CHECK_THROWS_AS(restore_highlights(light, 1, 2), std::invalid_argument);
    CHECK_THROWS_AS(restore_highlights(std::span(light).first(7), 3, 2), std::invalid_argument);
}

namespace {

double light_of_code(double code) {
    const double v = code / 255;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

double code_of_light(double light) {
    return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055);
}

constexpr double pale_codes = 12,
                 lamp_gain = 3.5; // codes that a pale colour may change by; times that a lamp grows at least

} // namespace

TEST_CASE("photograph: of the colours with a channel at white, surfaces stay and lamps grow", "[photograph]") {
    // The ball of a scene as it was rendered, and the same in other colours; a sky; skin.
    const std::array<double, 3> surfaces[] = {
        {196, 236, 255}, {255, 236, 196}, {236, 196, 255}, {255, 196, 236}, {196, 255, 236}, {135, 206, 255},
        {160, 200, 255}, {255, 224, 189}, {250, 240, 250}, {255, 182, 193}, {230, 245, 255}, {255, 255, 180},
        {200, 255, 255}, {255, 200, 255}, {255, 255, 130}, {255, 255, 242}, {244, 255, 255}};
    for (const auto& codes : surfaces) {
        std::vector<float> light;
        for (const double code : codes)
            light.push_back(static_cast<float>(light_of_code(code)));
        restore_highlights(light, 3, 4);
        for (std::size_t c = 0; c < 3; ++c) {
            CAPTURE(codes[0], codes[1], codes[2], c);
            CHECK(std::abs(code_of_light(static_cast<double>(light[c])) - codes[c]) <= pale_codes);
        }
    }
    const std::array<double, 3> lamps[] = {{255, 200, 60}, {255, 60, 40},   {60, 100, 255}, {40, 255, 90},
                                           {255, 90, 20},  {255, 255, 255}, {255, 255, 40}};
    for (const auto& codes : lamps) {
        std::vector<float> light;
        for (const double code : codes)
            light.push_back(static_cast<float>(light_of_code(code)));
        const std::vector<float> before = light;
        restore_highlights(light, 3, 4);
        for (std::size_t c = 0; c < 3; ++c) {
            CAPTURE(codes[0], codes[1], codes[2], c);
            CHECK(light[c] >= static_cast<float>(lamp_gain) * before[c]);
        }
    }
}

TEST_CASE("photograph: depth has its edge where the picture has one, and rows may have gaps", "[photograph]") {
    constexpr int across = 48, down = 32, edge = 21; // which is none of the depth's grid
    std::vector<float> color(std::size_t{across + 5} * down * 3, 77.0f), depth(std::size_t{12 + 3} * 8, -1.0f);
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x)
            std::fill_n(&color[static_cast<std::size_t>((y * (across + 5) + x) * 3)], 3, x < edge ? 0.1f : 0.9f);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 12; ++x)
            depth[static_cast<std::size_t>(y * 15 + x)] = x < 5 ? 2.0f : x == 5 ? 1.25f : 1.0f;
    const HostFloats picture{color.data(), across, down, 3, std::size_t{across + 5} * 3},
        coarse{depth.data(), 12, 8, 1, 15};
    const std::vector<float> fine = upsample_along_edges(coarse, picture);
    REQUIRE(fine.size() == std::size_t{across} * down);
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x) {
            const float z = fine[static_cast<std::size_t>(y * across + x)];
            if (x < edge - 5 || x > edge + 6)
                CHECK(std::abs(z - (x < edge ? 2.0f : 1.0f)) < 0.01f);
        }
    const std::vector<float> unknown(6, std::numeric_limits<float>::quiet_NaN());
    CHECK(std::ranges::all_of(upsample_along_edges(floats_of(unknown, 3, 2, 1), picture),
                              [](float z) { return std::isnan(z); }));
    CHECK_THROWS_AS(upsample_along_edges(picture, picture), std::invalid_argument);
    CHECK_THROWS_AS(upsample_along_edges(coarse, coarse), std::invalid_argument);
    CHECK_THROWS_AS(upsample_along_edges({}, picture), std::invalid_argument);
    const std::vector<float> wide(std::size_t{3} * static_cast<std::size_t>(2 * picture.width * picture.height));
    CHECK_THROWS_WITH(upsample_along_edges(coarse, {wide.data(), 2 * picture.width, picture.height, 3}),
                      ContainsSubstring("same ratio of width to height"));
}

TEST_CASE("photograph: the order of the picture's channels changes no bit of the depth", "[photograph]") {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> any(0, 1);
    std::vector<float> color(120 * 90 * 3), depth(40 * 30);
    std::ranges::generate(color, [&] { return any(random); });
    std::ranges::generate(depth, [&] { return 1 + any(random); });
    const auto fine = [&] { return upsample_along_edges(floats_of(depth, 40, 30, 1), floats_of(color, 120, 90, 3)); };
    const std::vector<float> red_first = fine();
    for (std::size_t i = 0; i < color.size(); i += 3)
        std::swap(color[i], color[i + 2]);
    CHECK((fine() == red_first)); // and prints none of them
}
