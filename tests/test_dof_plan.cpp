// What dof decides before it starts: layers, apertures as spans, and which tiles each layer reaches. No device.

#include "catch.hpp"

#include "operations/dof/dof_layers.hpp"

using namespace fathom;

TEST_CASE("dof plan: layers are even within an octave, and the middle one is what is in focus") {
    for (const double per_octave : {3.0, 8.0}) {
        const LayerScale scale = layer_scale({per_octave, 0, 0}, 512);
        const auto octave = static_cast<int>(per_octave);
        CHECK(scale.count() <= most_layers);
        CHECK(scale.circle(scale.middle) == 1);
        CHECK(scale.circle(scale.middle + octave) == 2);
        CHECK(scale.circle(scale.middle - 3 * octave) == -8);
        CHECK(scale.circle(scale.count() - 1) >= 512);
        for (int i = scale.middle; i + 1 < scale.count(); ++i) {
            CHECK(scale.circle(i + 1) > scale.circle(i));
            CHECK(scale.circle(i + 1) <= scale.circle(i) * (1 + 1.0 / per_octave) * (1 + 1e-12));
            CHECK(scale.circle(2 * scale.middle - i - 1) == -scale.circle(i + 1));
        }
    }
}

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

TEST_CASE("dof plan: a layer knows where the one just before it was") {
    const LayerScale scale = layer_scale({8, 0, 0}, 512);
    std::vector<TileBits> tiles(7 * 9);
    const int first = scale.middle + 20;
    for (const int layer : {first, first + 1, first + 3})
        put(tiles, 0, layer);
    const LayerPlan plan = layer_plan(tiles, 7, {.aperture = {}, .scale = scale});
    REQUIRE(plan.passes.size() == 3);
    const auto follow = [&](std::size_t pass) { return entries(plan, plan.passes[pass]).front().follow; };
    CHECK(follow(0) == 0);
    CHECK(follow(1) == 1);
    CHECK(follow(2) == 0);

    // The same for layers that are read directly, which share a launch, and for the first one with strips.
    std::vector<TileBits> small(7 * 9);
    for (const int away : {1, 2, 4, 18, 19})
        put(small, 0, scale.middle + away);
    const LayerPlan direct = layer_plan(small, 7, {.aperture = {}, .scale = scale});
    REQUIRE(direct.passes.size() == 2);
    const Entry group = entries(direct, direct.passes[0]).front();
    CHECK(group.reach == (1u | 1u << 1 | 1u << 3 | 1u << 17));
    CHECK(group.follow == 1u << 1);
    CHECK(entries(direct, direct.passes[1]).front().follow == 1);
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

TEST_CASE("dof plan: a tile's layers come front to back, each once, within the memory that there is") {
    std::minstd_rand random(7);
    for (const auto& [across, down] : {std::pair{5, 40}, {30, 135}, {120, 90}})
        for (const Quality quality : {Quality::fast, Quality::balanced}) {
            const LayerScale scale = layer_scale(layer_spacing(quality, {}), 512);
            std::vector<TileBits> tiles(static_cast<std::size_t>(across * down));
            for (int patch = 0; patch < 60; ++patch) {
                const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
                const int left = below(across), top = below(down), layer = below(scale.count());
                for (int y = top; y < std::min(top + 12, down); ++y)
                    for (int x = left; x < std::min(left + 3, across); ++x)
                        put(tiles, static_cast<std::size_t>(y * across + x), layer);
                put(tiles, static_cast<std::size_t>(top * across + left), jump_bit + patch % 2);
            }
            const LayerPlan plan = layer_plan(tiles, across, {.aperture = {}, .scale = scale, .quality = quality});
            std::map<std::pair<int, int>, int> last;
            std::set<std::tuple<int, int, int>> reached;
            bool in_order = true;
            for (const LayerPass& pass : plan.passes) {
                const auto layer = static_cast<int>(pass.cell > 1 ? pass.cells.layer : pass.gather.layer);
                for (const Entry& entry : entries(plan, pass)) {
                    int& before = last.try_emplace({entry.x, entry.y}, -1).first->second;
                    for (int i = 0; i < 32; ++i) {
                        if (!(entry.reach >> i & 1u))
                            continue;
                        in_order = in_order && layer + i > before;
                        before = layer + i;
                        reached.insert({entry.x, entry.y, layer + i});
                    }
                }
            }
            INFO(across << " x " << down << " tiles, quality " << static_cast<int>(quality));
            CHECK(in_order);
            for (int y = 0; y < down; ++y)
                for (int x = 0; x < across; ++x)
                    for (int layer = 0; layer < scale.count(); ++layer)
                        if (has_bit(tiles[static_cast<std::size_t>(y * across + x)], layer))
                            REQUIRE(reached.contains({x, y, layer}));
            CHECK(plan.strip_elements <= layer_floats);
            CHECK(plan.cell_elements <= layer_floats);
        }
}

TEST_CASE("dof plan: a tile sees what is hidden if its aperture reaches the half of a tile that hides it") {
    constexpr int across = 14, down = 21; // halves of tiles
    const LayerScale scale = layer_scale(layer_spacing(Quality::accurate, {}), 512);
    for (const auto& [layer, rows] : {std::pair{scale.middle, 0},
                                      {scale.middle + 8, 1},
                                      {scale.middle - 8 * 5, 2},    // 16 pixels on every side
                                      {scale.middle + 8 * 6, 4},    // 32
                                      {scale.middle + 8 * 7, 8}}) { // 64
        for (const int half : {6, 7}) {
            std::vector<TileBits> hiding(across * down);
            put(hiding, 10 * across + static_cast<std::size_t>(half), layer);
            const auto seeing = tiles_seeing(hiding, across, {.aperture = {}, .scale = scale});
            const int halves = (4 * rows + 15) / 16; // that a radius of 8 x rows reaches
            for (int y = 0; y < down; ++y)
                for (int x = 0; x < across / 2; ++x) {
                    const bool near = std::min(std::abs(2 * x - half), std::abs(2 * x + 1 - half)) <= halves;
                    INFO("layer " << layer - scale.middle << ", half " << half << ", tile " << x << ", " << y);
                    CHECK((seeing[static_cast<std::size_t>(y * across / 2 + x)] != 0) ==
                          (near && std::abs(y - 10) <= rows));
                }
        }
    }
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
