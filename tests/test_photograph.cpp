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
}
