// What dof decides before it starts: slices, apertures as spans, and which tiles each slice reaches. No device.

#include "catch.hpp"

#include "operations/dof_slices.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

using namespace fathom;

namespace {

/// What each pixel around one counts, of a pixel that is the n-th of its strip's rows.
std::map<std::pair<int, int>, double> shares(const ApertureSpans& aperture, int phase, int pitch) {
    std::map<std::pair<int, int>, double> found;
    const int height = 2 * aperture.reach + 1;
    for (int row = 0; row < height; ++row) {
        const auto entry = static_cast<std::size_t>(phase * height + row);
        for (auto i = aperture.starts[entry]; i < aperture.starts[entry + 1]; ++i)
            for (int x = aperture.spans[i].low; x < aperture.spans[i].high; ++x)
                for (int y = 0; y < pitch; ++y)
                    found[{x, (row - aperture.reach) * pitch - phase + y}] +=
                        static_cast<double>(aperture.spans[i].weight);
    }
    return found;
}

double area(const Aperture& aperture, double radius) {
    const int n = aperture.blades;
    return radius * radius * (n ? n * std::sin(2 * std::numbers::pi / n) / 2 : std::numbers::pi);
}

} // namespace

TEST_CASE("dof plan: slices are even within an octave, and the middle one is what is in focus") {
    for (const int per_octave : {3, 8}) {
        const SliceScale scale = slice_scale(per_octave, 512);
        CHECK(scale.count() < 159); // the last bit of a tile is taken
        CHECK(scale.circle(scale.middle) == 1);
        CHECK(scale.circle(scale.middle + per_octave) == 2);
        CHECK(scale.circle(scale.middle - 3 * per_octave) == -8);
        CHECK(scale.circle(scale.count() - 1) >= 512);
        for (int i = scale.middle; i + 1 < scale.count(); ++i) {
            CHECK(scale.circle(i + 1) > scale.circle(i));
            CHECK(scale.circle(i + 1) <= scale.circle(i) * (1 + 1.0 / per_octave));
            CHECK(scale.circle(2 * scale.middle - i - 1) == -scale.circle(i + 1));
        }
    }
}

TEST_CASE("dof plan: spans add up to the aperture, which is upside down before the focus") {
    double worst = 0;
    for (const Aperture& shape : {Aperture{}, Aperture{3, 0}, Aperture{5, 17}, Aperture{6, 0}, Aperture{64, 1}}) {
        for (const double circle : {1.5, 2.0, 3.7, 9.0, 20.0, 31.0, 40.0, 97.0}) {
            for (const int pitch : {1, 2, 4}) {
                const ApertureSpans behind = aperture_spans(shape, circle, 1, true, pitch);
                const ApertureSpans before = aperture_spans(shape, -circle, 1, true, pitch);
                const ApertureSpans turned = aperture_spans(shape, circle, 1, false, pitch);
                INFO(shape.blades << " corners, circle " << circle << ", pitch " << pitch);
                for (int phase = 0; phase < pitch; ++phase) {
                    double sum = 0;
                    for (const auto& [place, share] : shares(behind, phase, pitch)) {
                        sum += share;
                        REQUIRE(std::abs(place.first) <= behind.columns + 1);
                        REQUIRE(share > 0);
                        REQUIRE(share <= 1);
                        REQUIRE(share * 4096 == std::floor(share * 4096)); // sums of it are exact
                    }
                    const double off = std::abs(sum / area(shape, circle / 2) - 1);
                    worst = std::max(worst, off);
                    CHECK(off < 0.02);
                }
                if (pitch != 1)
                    continue;
                const auto one = shares(behind, 0, 1), other = shares(before, 0, 1), flipped = shares(turned, 0, 1);
                const bool whole = std::ranges::all_of(behind.spans, [](const auto& span) { return span.weight == 1; });
                for (const auto& [place, share] : one) {
                    const auto point = other.find({-place.first, -place.second});
                    const auto line = flipped.find({place.first, -place.second});
                    REQUIRE((whole || (point != other.end() && point->second == share)));
                    REQUIRE((whole || (line != flipped.end() && line->second == share)));
                }
            }
        }
    }
    std::printf("dof, apertures as spans: area off by at most %.4f\n", worst);
}

TEST_CASE("dof plan: every tile that a slice reaches is worked on, and no other") {
    constexpr int across = 7, down = 9;
    const SliceScale scale = slice_scale(8, 512);
    for (const auto& [slice, columns, rows] : {std::tuple{scale.middle, 0, 0},
                                               {scale.middle + 8, 1, 1},
                                               {scale.middle - 8 * 5, 1, 1},
                                               {scale.middle + 8 * 7, 1, 4}}) { // 64 pixels up and down
        std::vector<TileBits> tiles(across * down);
        tiles[4 * across + 3][static_cast<std::size_t>(slice / 32)] |= 1u << (slice % 32);
        const SlicePlan plan = slice_plan(tiles, across, {.aperture = {}, .scale = scale});
        REQUIRE(plan.passes.size() == 1);
        const SlicePass& pass = plan.passes.front();
        CHECK(pass.fill == (slice < scale.middle));
        CHECK(!pass.bright);
        CHECK(pass.direct == (std::abs(scale.circle(slice)) < 5));
        std::set<std::pair<int, int>> found;
        for (params::u32 i = 0; i < pass.gather.tiles; ++i) {
            const params::u32 entry = plan.lists[pass.gather.list + i];
            CHECK(entry >> 31 == 0); // no slice before it
            found.insert({static_cast<int>(entry & 0xffff), static_cast<int>(entry >> 16)});
        }
        CHECK(found.size() == pass.gather.tiles);
        for (int y = 0; y < down; ++y)
            for (int x = 0; x < across; ++x)
                CHECK(found.contains({x, y}) == (std::abs(x - 3) <= columns && std::abs(y - 4) <= rows));
    }
    // The next slice knows where this one was.
    std::vector<TileBits> tiles(across * down);
    const int first = scale.middle + 20;
    for (const int slice : {first, first + 1, first + 3})
        tiles.front()[static_cast<std::size_t>(slice / 32)] |= 1u << (slice % 32);
    const SlicePlan plan = slice_plan(tiles, across, {.aperture = {}, .scale = scale});
    REQUIRE(plan.passes.size() == 3);
    const auto follows = [&](std::size_t pass) { return plan.lists[plan.passes[pass].gather.list] >> 31; };
    CHECK(follows(0) == 0);
    CHECK(follows(1) == 1);
    CHECK(follows(2) == 0);
}
