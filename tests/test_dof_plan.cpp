// What dof decides before it starts: layers, apertures as spans, and which tiles each layer reaches. No device.

#include "catch.hpp"

#include "operations/dof/dof_layers.hpp"

using namespace fathom;

namespace {

/// The weight of each pixel around one that is the n-th of its strip's rows.
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

TEST_CASE("dof plan: of round apertures each layer's circle and an offset are as much larger as any other's") {
    for (const Quality quality : {Quality::balanced, Quality::fast}) {
        const LayerSpacing spacing = layer_spacing(quality, {});
        const LayerScale scale = layer_scale(spacing, 512);
        CHECK(scale.count() <= most_layers);
        CHECK(scale.circle(scale.middle) == 1);
        CHECK(scale.circle(scale.count() - 1) >= 512);
        double least = INFINITY, most = 0;
        for (int i = scale.middle; i + 1 < scale.count(); ++i) {
            const double times = (scale.circle(i + 1) + spacing.offset) / (scale.circle(i) + spacing.offset);
            least = std::min(least, times);
            most = std::max(most, times);
            CHECK(scale.circle(2 * scale.middle - i - 1) == -scale.circle(i + 1));
        }
        const double even = std::exp2(1 / spacing.per_octave);
        std::printf("dof plan, layers: %.4f to %.4f times as large as the one before, %.4f if even\n", least, most,
                    even);
        // The law of an octave is off by 0.008 of an octave.
        CHECK(least > even - 0.02);
        CHECK(most < even + 0.02);
    }
}

TEST_CASE("dof plan: spans add up to the aperture, which is upside down before the focus") {
    constexpr Quality exact = Quality::accurate;
    double worst = 0;
    for (const Aperture& shape : {Aperture{}, Aperture{3, 0}, Aperture{5, 17}, Aperture{6, 0}, Aperture{64, 1}})
        for (const double circle : {1.5, 2.0, 3.7, 9.0, 20.0, 31.0, 40.0, 97.0})
            for (const int pitch : {1, 2, 4}) {
                const ApertureSpans behind = aperture_spans(shape, circle, 1, true, pitch, exact);
                const ApertureSpans before = aperture_spans(shape, -circle, 1, true, pitch, exact);
                const ApertureSpans turned = aperture_spans(shape, circle, 1, false, pitch, exact);
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
                REQUIRE((one.size() == other.size() && one.size() == flipped.size()));
                for (const auto& [place, share] : one) {
                    const auto point = other.find({-place.first, -place.second});
                    const auto line = flipped.find({place.first, -place.second});
                    REQUIRE((point != other.end() && point->second == share));
                    REQUIRE((line != flipped.end() && line->second == share));
                }
            }
    std::printf("dof, apertures as spans: area off by at most %.4f\n", worst);
}

// Where a pixel lies in its strip's row adds (pitch^2 - 1) / 12.
TEST_CASE("dof plan: strips of several rows have the variance of the circle, however their spans are rounded") {
    double worst = 0, worst_center = 0;
    for (const auto& [shape, across, up] : {std::tuple{Aperture{}, 0.25, 0.25}, {Aperture{0, 0, 2}, 0.0625, 0.25}})
        for (const double circle : {13.0, -20.5, 25.0, -31.0, 44.0})
            for (const int pitch : {1, 2, 4}) {
                const double radius = std::abs(circle) / 2;
                if (radius < 5 * pitch)
                    continue;
                const ApertureSpans spans = aperture_spans(shape, circle, 1, true, pitch, Quality::balanced);
                double x_square = 0, y_square = 0;
                for (int phase = 0; phase < pitch; ++phase) {
                    double sum = 0, x_sum = 0, y_sum = 0, x_part = 0, y_part = 0;
                    for (const auto& [place, share] : shares(spans, phase, pitch)) {
                        const auto& [x, y] = place;
                        sum += share;
                        x_sum += share * x;
                        y_sum += share * y;
                        x_part += share * x * x;
                        y_part += share * y * y;
                    }
                    worst_center = std::max({worst_center, std::abs(x_sum / sum), std::abs(y_sum / sum)});
                    x_square += x_part / sum / pitch;
                    y_square += y_part / sum / pitch;
                }
                const auto off = [&](double found, double expected) {
                    return std::abs(found / (expected * radius * radius + 1.0 / 12) - 1);
                };
                worst = std::max({worst, off(x_square, across), off(y_square, up)});
                INFO("ratio " << shape.ratio << ", circle " << circle << ", pitch " << pitch);
                CHECK(off(x_square, across) < 0.02);
                CHECK(off(y_square, up) < 0.02);
            }
    std::printf("dof plan, strips: variance off by at most %.4f, centre by %.4f pixels\n", worst, worst_center);
}

// What comes out has the circle's variance along both axes: that of the cells' weights, of the pixels in a cell, and of the
// interpolation between two cells, 1/6 of a cell's and 1/12.
TEST_CASE("dof plan: cells have the variance of the circle, whichever of the rows at once they are for") {
    double worst = 0;
    for (const auto& [shape, across, up] :
         {std::tuple{Aperture{}, 0.25, 0.25}, {Aperture{6, 10}, 2.5 / 12, 2.5 / 12}, {Aperture{0, 0, 2}, 0.0625, 0.25}})
        for (const int cell : {2, 4, 8})
            for (const double circle : {32.0 * cell, -41.0 * cell})
                for (const int rows : {2, 4}) {
                    const ApertureCells cells = aperture_cells(shape, circle, 1, true, cell, rows);
                    const double radius = std::abs(circle) / 2;
                    for (int nth = 0; nth < rows; ++nth) {
                        double sum = 0, x_sum = 0, y_sum = 0, x_square = 0, y_square = 0;
                        for (int r = -cells.reach; r < cells.reach + rows; ++r) {
                            const auto entry = static_cast<std::size_t>(2 * (r + cells.reach));
                            const auto aside = static_cast<int>(cells.starts[entry]);
                            for (int x = -aside; x <= aside; ++x) {
                                const auto at =
                                    cells.starts[entry + 1] + static_cast<params::u32>((x + aside) * rows + nth);
                                const auto weight = static_cast<double>(cells.weights[at]);
                                REQUIRE(weight >= 0);
                                sum += weight;
                                x_sum += weight * x;
                                y_sum += weight * (r - nth);
                                x_square += weight * x * x;
                                y_square += weight * (r - nth) * (r - nth);
                            }
                        }
                        const double square = cell * cell, inside = (square - 1) / 12, between = square / 6 + 1.0 / 12;
                        const auto off = [&](double of_cells, double expected) {
                            return std::abs(
                                (of_cells * square + inside + between) / (expected * radius * radius + 1.0 / 12) - 1);
                        };
                        worst = std::max({worst, off(x_square / sum, across), off(y_square / sum, up)});
                        CHECK(std::abs(x_sum / sum) < 1e-3);
                        CHECK(std::abs(y_sum / sum) < 1e-3);
                    }
                }
    std::printf("dof, apertures over cells: variance off by at most %.4f\n", worst);
    CHECK(worst < 0.005); // 16 lines a row of cells
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

TEST_CASE("dof plan: what a pixel reads grows no faster than its circle, and is the pixel where it is in focus") {
    const std::vector<TileBits> none(9 * 9);
    for (const auto& [name, quality] : {std::pair{"balanced", Quality::balanced}, {"fast", Quality::fast}}) {
        const LayerScale scale = layer_scale(layer_spacing(quality, {}), 512);
        // What a pixel reads, two sums for each span, and columns summed for each of a tile's.
        const auto cost = [&, quality = quality](int layer) {
            std::vector<TileBits> tiles = none;
            put(tiles, 40, layer);
            const LayerPlan plan = layer_plan(tiles, 9, {.aperture = {}, .scale = scale, .quality = quality});
            const LayerPass& pass = plan.passes.front();
            if (pass.cell > 1) // weights of a cell's aperture, for each of its pixels
                return std::pair{static_cast<double>(plan.weights.size()) / (4.0 * pass.cell * pass.cell), 1.0};
            return std::pair{2.0 * static_cast<double>(plan.spans.size()) / pass.gather.pitch,
                             1 + 2.0 * pass.gather.pad / params::dof_tile_columns};
        };
        const auto with_circle = [&](double circle) {
            int layer = scale.middle;
            while (scale.circle(layer) < circle)
                ++layer;
            return layer;
        };
        const double most = cost(with_circle(4)).first / scale.circle(with_circle(4)); // a pixel of the circle
        CHECK(cost(scale.middle).first == 2);
        std::printf("dof, %s, circle: sums or cells that a pixel reads, columns summed for each:", name);
        for (double circle = 8; circle <= 512; circle *= 2) {
            const int layer = with_circle(circle);
            const auto [read, columns] = cost(layer);
            std::printf("  %g: %.1f %.1f", scale.circle(layer), read, columns);
            CHECK(read / scale.circle(layer) <= most);
            CHECK(columns <= 2);
        }
        std::printf("\n");
    }
}

TEST_CASE("dof plan: parts of pixels add up to the aperture, each with its own middle") {
    double worst = 0;
    for (const Aperture& shape : {Aperture{}, Aperture{3, 0}, Aperture{5, 17}, Aperture{6, 0}})
        for (const double circle : {1.2, 2.0, 5.0, 15.0}) {
            double sum = 0, u = 0, v = 0, square = 0;
            for (const auto& tap : aperture_taps(shape, circle, 1, true)) {
                const auto weight = static_cast<double>(tap.weight);
                sum += weight;
                u += weight * static_cast<double>(tap.u);
                v += weight * static_cast<double>(tap.v);
                square += weight * static_cast<double>(tap.u * tap.u + tap.v * tap.v);
                // behind the focus a pixel to the right shows through the left of the lens
                CHECK(std::abs(static_cast<double>(tap.u) * circle / 2 + tap.column) <= 0.5 + 1e-5);
                CHECK(std::abs(static_cast<double>(tap.v) * circle / 2 + tap.row) <= 0.5 + 1e-5);
            }
            worst = std::max({worst, std::abs(sum - 1), std::abs(u), std::abs(v)});
            if (shape.blades == 0) // the disc's, less what each part has around its own middle
                CHECK(std::abs(square - 0.5) < 0.02);
        }
    std::printf("dof plan, parts of pixels: sum and moments off by %.1e\n", worst);
    // Half a line, of 64 a part and 7 parts a pixel, of a triangle's lower side: 1.73/1.3 of its area, half way down.
    CHECK(worst < 0.5 / (64 * 7 * 0.6) * (1.73 / 1.3) * 0.5);
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
