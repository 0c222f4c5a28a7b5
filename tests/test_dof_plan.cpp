// What dof decides before it starts: which tiles each layer reaches, and what it looks up about half-planes. No device.

#include "catch.hpp"

#include "operations/dof/dof_layers.hpp"

using namespace fathom;

// A tile of a pass's list: its place, which of the pass's layers reach it, and which of these follow one that does, a bit each.
struct Entry {
    int x, y;
    params::u32 reach, follow;
};

std::vector<Entry> entries(const LayerPlan& plan, const LayerPass& pass) {
    std::vector<Entry> found;
    const bool of_cells = pass.cell > 1, grouped = pass.direct || of_cells;
    const std::size_t words = grouped ? 3 : 1;
    const params::u32 tiles = of_cells ? pass.cells.tiles : pass.gather.tiles;
    const params::u32 list = of_cells ? pass.cells.tile_list : pass.gather.list;
    for (std::size_t i = 0; i < tiles; ++i) {
        const params::u32* entry = &plan.lists[list + words * i];
        const auto x = static_cast<int>(entry[0] & 0xffff), y = static_cast<int>(entry[0] >> 16 & 0x3fff);
        found.push_back(grouped ? Entry{x, y, entry[1], entry[2]} : Entry{x, y, 1, entry[0] >> 31});
    }
    return found;
}

void put(std::vector<TileBits>& tiles, std::size_t tile, int layer) {
    tiles[tile][static_cast<std::size_t>(layer / 32)] |= 1u << (layer % 32);
}

TEST_CASE("dof plan: every tile that a layer reaches is worked on, and no other") {
    constexpr int across = 7, down = 21;
    const LayerScale scale = layer_scale({8, 0, 0}, 512);
    for (const auto& [layer, columns, rows] : {std::tuple{scale.middle, 0, 0},
                                               {scale.middle + 8, 1, 1},
                                               {scale.middle - 8 * 5, 1, 2},    // 16 pixels up and down
                                               {scale.middle + 8 * 7, 1, 8}}) { // 64
        std::vector<TileBits> tiles(across * down);
        put(tiles, 10 * across + 3, layer);
        for (const int half : {0, 1})
            put(tiles, 10 * across + 3, jump_bit + half);
        const LayerPlan plan = layer_plan(tiles, across, {.aperture = {}, .scale = scale});
        REQUIRE(plan.passes.size() == 1);
        const LayerPass& pass = plan.passes.front();
        CHECK(pass.fill == (layer < scale.middle));
        CHECK(!pass.bright);
        CHECK(pass.direct == (std::abs(scale.circle(layer)) < 5));
        std::set<std::pair<int, int>> found;
        for (const Entry& entry : entries(plan, pass)) {
            CHECK(entry.reach == 1);
            CHECK(entry.follow == 0);
            found.insert({entry.x, entry.y});
        }
        CHECK(found.size() == entries(plan, pass).size());
        for (int y = 0; y < down; ++y)
            for (int x = 0; x < across; ++x)
                CHECK(found.contains({x, y}) == (std::abs(x - 3) <= columns && std::abs(y - 10) <= rows));
    }
}

TEST_CASE("dof plan: what lies behind is summed within reach of where something ends, and nowhere else") {
    constexpr int across = 7, down = 21;
    const LayerScale scale = layer_scale({8, 0, 0}, 512);
    for (const auto& [layer, rows, half] : {std::tuple{scale.middle - 4, 1, 0}, // read directly
                                            {scale.middle - 4, 1, 1},
                                            {scale.middle - 8 * 4, 1, 0}, // strips
                                            {scale.middle - 8 * 4, 1, 1},
                                            {scale.middle - 8 * 6, 4, 0}, // cells, 32 pixels aside
                                            {scale.middle - 8 * 6, 4, 1}}) {
        std::vector<TileBits> tiles(across * down);
        for (std::size_t i = 0; i < tiles.size(); ++i)
            put(tiles, i, layer);
        put(tiles, 5 * across + 2, jump_bit + half);
        const LayerPlan plan = layer_plan(tiles, across, {.aperture = {}, .scale = scale});
        REQUIRE(plan.passes.size() == 2);
        std::set<std::pair<int, int>> filled, rest;
        for (const LayerPass& pass : plan.passes)
            for (const Entry& entry : entries(plan, pass))
                (pass.fill ? filled : rest).insert({entry.x, entry.y});
        CHECK(filled.size() + rest.size() == tiles.size());
        for (int y = 0; y < down; ++y)
            for (int x = 0; x < across; ++x) {
                const bool near = (x == 2 || x == 1 + 2 * half) && std::abs(y - 5) <= rows;
                CHECK(filled.contains({x, y}) == near);
                CHECK(rest.contains({x, y}) == !near);
            }
    }
}

TEST_CASE("dof plan: layers over cells share launches") {
    const LayerScale scale = layer_scale({8, 0, 0}, 512);
    std::vector<TileBits> tiles(7 * 21);
    const int first = scale.middle + 8 * 7; // 64 pixels on every side
    for (const int layer : {first, first + 1, first + 3})
        put(tiles, 10 * 7 + 3, layer);
    const LayerPlan plan = layer_plan(tiles, 7, {.aperture = {}, .scale = scale});
    REQUIRE(plan.passes.size() == 1);
    for (const Entry& entry : entries(plan, plan.passes.front())) {
        if (entry.x != 3 || entry.y != 10)
            continue;
        CHECK(entry.reach == (1u | 1u << 1 | 1u << 3));
        CHECK(entry.follow == 1u << 1);
    }
    CHECK(plan.cell_elements == 4 * plan.passes.front().cells.one);
}

TEST_CASE("dof plan: half-planes have the share and the moment that they are found by") {
    const auto circle = aperture_halves({}, true);
    REQUIRE(circle.size() == 256);
    double off_circle = 0;
    for (std::size_t f = 4; f < 252; ++f) {
        const double d = static_cast<double>(circle[f][2]);
        const double share = (std::acos(d) - d * std::sqrt(1 - d * d)) / std::numbers::pi;
        const double moment = 2 / (3 * std::numbers::pi) * std::pow(1 - d * d, 1.5);
        off_circle = std::max({off_circle, std::abs(share - static_cast<double>(f) / 255),
                               std::abs(moment - static_cast<double>(circle[f][3]))});
    }
    // A triangle with its corner on top, point by point: y down in an upright image.
    const auto triangle = aperture_halves({3, 0}, true);
    REQUIRE(triangle.size() == 64 * 256);
    double off_share = 0, off_moment = 0, off_angle = 0;
    for (const std::size_t direction : {std::size_t{0}, std::size_t{9}, std::size_t{30}, std::size_t{47}}) {
        const double around = 4.0 * static_cast<double>(direction) / 64 - 1;
        const double y = around <= 1 ? around : 2 - around, x = around <= 1 ? 1 - std::abs(y) : std::abs(y) - 1;
        const double length = std::hypot(x, y);
        for (const std::size_t f : {std::size_t{40}, std::size_t{128}, std::size_t{200}}) {
            const auto& entry = triangle[direction * 256 + f];
            const auto c = static_cast<double>(entry[0]), s = static_cast<double>(entry[1]);
            const double n_x = (x * c - y * s) / length, n_y = (x * s + y * c) / length;
            long all = 0, inside = 0;
            double moment_x = 0, moment_y = 0;
            for (int i = 0; i < 1000; ++i)
                for (int j = 0; j < 1000; ++j) {
                    const double px = (2 * i + 1) / 1000.0 - 1, py = (2 * j + 1) / 1000.0 - 1;
                    if (py > 0.5 || std::abs(px) * std::sqrt(3.0) > py + 1)
                        continue;
                    ++all;
                    if (n_x * px + n_y * py < static_cast<double>(entry[2]))
                        continue;
                    ++inside;
                    moment_x += px;
                    moment_y += py;
                }
            const auto whole = static_cast<double>(all);
            off_share =
                std::max(off_share, std::abs(static_cast<double>(inside) / whole - static_cast<double>(f) / 255));
            off_moment =
                std::max(off_moment, std::abs(std::hypot(moment_x, moment_y) / whole - static_cast<double>(entry[3])));
            off_angle = std::max(off_angle, std::abs(std::remainder(std::atan2(moment_y, moment_x) - std::atan2(y, x),
                                                                    2 * std::numbers::pi)));
        }
    }
    std::printf("dof plan, half-planes: circle off by %.1e; triangle by %.1e of its area, moment %.1e, angle %.3f\n",
                off_circle, off_share, off_moment, off_angle);
    CHECK(off_circle < 1e-3);
    CHECK(off_share < 4e-3);
    CHECK(off_moment < 2e-3);
    CHECK(off_angle < 0.03); // normals are tried in steps of 0.025
}
