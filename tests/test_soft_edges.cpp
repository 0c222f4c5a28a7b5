// Edges of depth that a filter has made soft. The oracle is the depth before the filter: cards of known planes and colours, softened by
// plain loops in double. Exact depth stays as it is, whatever it shows.
#include "catch.hpp"
#include "random_scene.hpp"
#include "soften.hpp"
#include "test_device.hpp"

#include "camera/photograph.hpp"

#include <fathom/linearize.hpp>

#include <iostream>
#include <random>

using namespace fathom;
using fathom::test::Scene;

namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();

/// Slanted cards of one colour each before a wall, some of them posts of 3 pixels.
struct Cards {
    static constexpr int width = 200, height = 150;
    std::vector<float> z, light;

    /// `rays`: along each side of a pixel, of which both are means. `wall`: 1/z of what is behind all cards.
    explicit Cards(unsigned seed, int rays = 1, double wall = 0.05) {
        std::mt19937 random(seed);
        const auto number = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
        struct Card {
            double x, y, half_width, half_height, inverse, slope;
            bool is_round;
            std::array<float, 3> color;
        };
        std::vector<Card> cards;
        for (int i = 0; i < 12; ++i) {
            const bool is_post = i % 3 == 0;
            cards.push_back({number(20, width - 20),
                             number(30, height - 30),
                             is_post ? 1.5 : number(8, 30),
                             is_post ? 40 : number(8, 30),
                             1 / number(3, 9),
                             number(-2e-4, 2e-4),
                             !is_post && i % 2 == 0,
                             {float(number(0, 1)), float(number(0, 1)), float(number(0, 1))}});
        }
        const auto at = [&](double x, double y) {
            double inverse = wall * (1 + 2e-3 * y);
            std::array<float, 3> color{0.5f, 0.5f, 0.5f};
            for (const Card& card : cards) {
                const double u = (x - card.x) / card.half_width, v = (y - card.y) / card.half_height,
                             own = card.inverse + card.slope * (x - 0.5 - card.x);
                if ((card.is_round ? u * u + v * v < 1 : std::abs(u) < 1 && std::abs(v) < 1) && own > inverse) {
                    inverse = own;
                    color = card.color;
                }
            }
            return std::pair{1 / inverse, color};
        };
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                std::array<double, 4> sum{};
                for (int ray = 0; ray < rays * rays; ++ray) {
                    const auto [own, color] = at(x + (ray % rays + 0.5) / rays, y + (ray / rays + 0.5) / rays);
                    sum[3] += own / (rays * rays);
                    for (std::size_t c = 0; c < 3; ++c)
                        sum[c] += static_cast<double>(color[c]) / (rays * rays);
                }
                z.push_back(static_cast<float>(sum[3]));
                light.insert(light.end(), sum.begin(), sum.begin() + 3);
            }
    }

    HostFloats picture() const { return {light.data(), width, height, 3}; }
};

std::vector<float> sharpened(const std::vector<float>& z, int width, int height, const HostFloats& picture = {}) {
    return sharpened_distances({z.data(), width, height}, true, picture, in_threads);
}

std::vector<float> distances_of(const Scene& scene, int width, int height) {
    std::vector<float> z;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const Eigen::Vector3d ray =
                Eigen::Vector3d((x + 0.5) / width - 0.5, (y + 0.5 - height / 2.0) / width, 0.6).normalized();
            z.push_back(static_cast<float>(scene.distance(ray) * ray.z()));
        }
    return z;
}

} // namespace

TEST_CASE("soft edges: exact depth of anything keeps its edges", "[edges]") {
    int scenes = 0;
    for (int seed = 0; seed < 180; ++seed) {
        INFO(seed);
        std::mt19937 random(static_cast<unsigned>(seed));
        const Scene scene(static_cast<Scene::Kind>(seed % Scene::kinds), random);
        const int width = 96 + 8 * (seed % 13), height = 72 + 4 * (seed % 7);
        const std::vector<float> z = distances_of(scene, width, height);
        CHECK(sharpened(z, width, height).empty());
        CHECK(without_means({z.data(), width, height}, {z.data(), width, height}, false).empty());
        ++scenes;
    }
    std::cout << "exact depth of " << scenes << " random scenes stayed as it was\n";
}

TEST_CASE("soft edges: pixels of ramps get the depth of their side, and others keep theirs", "[edges]") {
    constexpr double off_side = 0.03; // of 1/z, a fifth of a typical step between two cards
    constexpr double most_spoilt = 0.015;
    // Of the pixels that a filter has moved so far, with the picture and without: measured less 0.03.
    constexpr std::array<std::array<double, 2>, 6> least{
        {{0.88, 0.58}, {0.75, 0.46}, {0.76, 0.32}, {0.64, 0.20}, {0.90, 0.52}, {0.68, 0.41}}};
    for (std::size_t i = 0; i < least.size(); ++i) {
        const auto& [name, soften] = test::softenings[i];
        long ramps = 0, with_picture = 0, alone = 0, spoilt = 0, far_off = 0;
        for (unsigned seed = 0; seed < 6; ++seed) {
            const Cards cards(seed);
            const std::vector<float> soft = soften(cards.z, Cards::width, Cards::height),
                                     seen = sharpened(soft, Cards::width, Cards::height, cards.picture()),
                                     blind = sharpened(soft, Cards::width, Cards::height);
            REQUIRE(seen.size() == soft.size());
            REQUIRE(blind.size() == soft.size());
            for (std::size_t k = 0; k < soft.size(); ++k) {
                const auto off = [&](const std::vector<float>& z) {
                    return std::abs(1 / static_cast<double>(z[k]) - 1 / static_cast<double>(cards.z[k]));
                };
                if (off(soft) > off_side) {
                    ++ramps;
                    with_picture += off(seen) < off_side;
                    alone += off(blind) < off_side;
                } else {
                    ++far_off;
                    spoilt += off(seen) > off_side;
                }
            }
        }
        const auto part = [](long some, long all) { return static_cast<double>(some) / static_cast<double>(all); };
        std::printf("%-28s %ld pixels off; mended with the picture %.1f %%, alone %.1f %%; spoilt %.2f %%\n", name,
                    ramps, 100 * part(with_picture, ramps), 100 * part(alone, ramps), 100 * part(spoilt, far_off));
        CHECK(part(with_picture, ramps) > least[i][0]);
        CHECK(part(alone, ramps) > least[i][1]);
        CHECK(part(spoilt, far_off) < most_spoilt);
    }
}

TEST_CASE("soft edges: means of both sides get the depth of the side that has most of the pixel", "[edges]") {
    constexpr double off_side = 0.02; // of z
    // Before a wall, and before what is so far away that 1/z of a mean is hardly more than its own.
    for (const double wall : {0.05, 1e-3}) {
        long means = 0, mended = 0, spoilt = 0, all = 0;
        for (unsigned seed = 0; seed < 6; ++seed) {
            const Cards averaged(seed, 6, wall), exact(seed, 1, wall);
            const HostFloats z{averaged.z.data(), Cards::width, Cards::height};
            const std::vector<float> made = without_means(z, z, false);
            REQUIRE(made.size() == exact.z.size());
            CHECK(without_means({exact.z.data(), Cards::width, Cards::height},
                                {exact.z.data(), Cards::width, Cards::height}, false)
                      .empty());
            for (std::size_t i = 0; i < made.size(); ++i) {
                const auto is_off = [&](const std::vector<float>& some) {
                    return std::abs(some[i] / exact.z[i] - 1) > static_cast<float>(off_side);
                };
                (is_off(averaged.z) ? means : all) += 1;
                mended += is_off(averaged.z) && !is_off(made);
                spoilt += !is_off(averaged.z) && is_off(made);
            }
        }
        const double part = static_cast<double>(mended) / static_cast<double>(means);
        std::printf("a wall at %.0f: %ld means of both sides, %.1f %% mended, %ld of %ld others spoilt\n", 1 / wall,
                    means, 100 * part, spoilt, all);
        CHECK(part > 0.8);
        CHECK(1000 * spoilt < all);
    }
}

TEST_CASE("soft edges: the same bits, however the rows are shared", "[edges]") {
    const Cards cards(3);
    const std::vector<float> soft = test::blurred(cards.z, Cards::width, Cards::height, 1.5);
    const auto made = [&](int at_once) {
        return sharpened_distances({soft.data(), Cards::width, Cards::height}, true, cards.picture(),
                                   [&](int rows, const std::function<void(int, int)>& work) {
                                       for (int y = 0; y < rows; y += at_once)
                                           work(y, std::min(y + at_once, rows));
                                   });
    };
    CHECK(made(1) == made(7));
    CHECK(made(1) == made(Cards::height));
}

TEST_CASE("soft edges: small images, holes and a sky", "[edges]") {
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 40}, {40, 1}, {2, 2}, {3, 5}}) {
        std::vector<float> z(static_cast<std::size_t>(width * height));
        for (std::size_t i = 0; i < z.size(); ++i)
            z[i] = 1 + static_cast<float>(i % 5);
        CHECK(sharpened(z, width, height).size() % z.size() == 0);
    }
    const Cards cards(1);
    std::vector<float> soft = test::blurred(cards.z, Cards::width, Cards::height, 1.5);
    for (std::size_t i = 0; i < soft.size(); ++i)
        soft[i] = i % 97 == 0 ? none : i / Cards::width < 10 ? std::numeric_limits<float>::infinity() : soft[i];
    const std::vector<float> made = sharpened(soft, Cards::width, Cards::height, cards.picture());
    REQUIRE(made.size() == soft.size());
    for (std::size_t i = 0; i < made.size(); ++i) {
        CHECK(std::isnan(made[i]) == std::isnan(soft[i]));
        CHECK((std::isnan(made[i]) || made[i] > 0));
    }
    std::vector<float> nothing(soft.size(), none);
    CHECK(sharpened(nothing, Cards::width, Cards::height).empty());
}

TEST_CASE("soft edges: stored depth of any encoding, with a mask of what has changed", "[edges]") {
    const Cards cards(2);
    const Device device = test_device();
    constexpr Layout layout{Cards::width, Cards::height};
    std::vector<std::uint16_t> millimetres;
    for (const float z : test::blurred(cards.z, Cards::width, Cards::height, 1.5))
        millimetres.push_back(static_cast<std::uint16_t>(std::lround(1000 * z)));
    Camera camera;
    camera.projection = perspective(1, 4.0 / 3, {0.5, 100});
    camera.width = layout.width, camera.height = layout.height;
    camera.encoding = Encoding::view_z;
    camera.scale = 0.001;
    camera.missing = 0;
    const StoredDepth stored{Image::from_host(device, Element::u16, millimetres.data(), layout), camera,
                             Storage::uint16};
    const Image color = Image::from_host(device, Element::f32, cards.light.data(), {layout.width, layout.height, 3}),
                mask(device, Element::u8, layout);
    const auto z_of = [&](const StoredDepth& depth) {
        std::vector<float> z(millimetres.size());
        linearize(depth).image.download(z.data());
        return z;
    };
    const StoredDepth sharp = sharpen_edges(stored, color, mask);
    const std::vector<float> before = z_of(stored), after = z_of(sharp);
    CHECK(after ==
          sharpened_distances({before.data(), layout.width, layout.height}, true, cards.picture(), in_threads));
    std::vector<std::uint8_t> changed(before.size());
    mask.download(changed.data());
    for (std::size_t i = 0; i < before.size(); ++i)
        CHECK(changed[i] == (before[i] != after[i]));
    CHECK(std::ranges::count(changed, 1) > 500);

    const StoredDepth exact{Image::from_host(device, Element::f32, cards.z.data(), layout), sharp.camera};
    CHECK(z_of(sharpen_edges(exact, color, mask)) == cards.z);
    mask.download(changed.data());
    CHECK(std::ranges::count(changed, 0) == std::ssize(changed));
    CHECK_THROWS_AS(sharpen_edges(stored, Image(device, Element::f32, {5, 4, 3})), std::invalid_argument);
    CHECK_THROWS_AS(sharpen_edges(stored, {}, Image(device, Element::f32, layout)), std::invalid_argument);
}
