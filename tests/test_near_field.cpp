// The near field's masks of dof_masks against their definitions, evaluated in double over all pairs of pixels.

#include "catch.hpp"
#include "images.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using images::floats;

namespace {

constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();
constexpr CircleOfConfusion circle{20, 100, 0, false};

Camera camera_of(int width, int height, double pixel_aspect = 1) { // rows so many times as high as columns are wide
    Camera camera;
    const double half = 0.5, tall = half * height * pixel_aspect / width;
    camera.projection = perspective(FrustumEdges{-half, half, -tall, tall}, {1, 100});
    camera.width = width;
    camera.height = height;
    camera.encoding = Encoding::view_z;
    return camera;
}

struct Picture {
    int width, height;
    double aspect = 1;
    std::vector<float> depth{};

    std::size_t size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

// Near blobs and single pixels before a background, with invalid pixels and sky among them. Near circles go up to
// `widest`.
Picture blobs(int width, int height, double widest, unsigned seed, double aspect = 1) {
    Picture picture{width, height, aspect};
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto depth_with = [](double c) { return static_cast<float>(static_cast<double>(circle.g) / (20 - c)); };
    picture.depth.resize(picture.size());
    for (float& z : picture.depth)
        z = depth_with(18 * unit(random) * unit(random) - 0.5);
    for (int blob = 0; blob < 4; ++blob) {
        const double x0 = width * unit(random), y0 = height * unit(random), r = 1 + 0.2 * height * unit(random);
        const double c = -widest * unit(random);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                if (std::hypot(x - x0, y - y0) < r)
                    picture.depth[static_cast<std::size_t>(y * width + x)] = depth_with(c * (1 + 0.1 * unit(random)));
    }
    for (int i = 0; i < 5; ++i) {
        picture.depth[random() % picture.size()] = depth_with(-widest * unit(random));
        picture.depth[random() % picture.size()] = nan_f;
        picture.depth[random() % picture.size()] = HUGE_VALF;
    }
    return picture;
}

DofMasksOptions everything(double sharp = 1, double transition = 1) {
    return {.sharp_px = sharp,
            .transition_px = transition,
            .near_weight = true,
            .focus_weight = true,
            .far_weight = true,
            .max_near_coc = true,
            .near_alpha = true,
            .disocclusion = true,
            .tile_px = 7,
            .tile_min_coc = true,
            .tile_max_coc = true};
}

struct Masks {
    std::vector<float> circle, near, reach, coverage, hidden, least, greatest;
};

Masks masks_of(Picture& picture, const DofMasksOptions& options) {
    static const Device device = test_device();
    const Image depth = Image::from_host(device, Element::f32, picture.depth.data(), {picture.width, picture.height});
    const DofMasks got = dof_masks({depth, camera_of(picture.width, picture.height, picture.aspect)}, circle, options);
    return {floats(got.coc),          floats(got.near_weight),  floats(got.max_near_coc), floats(got.near_alpha),
            floats(got.disocclusion), floats(got.tile_min_coc), floats(got.tile_max_coc)};
}

// Pixels of an infinite image within a disc; diameters as floats have them, so that ties are the same.
double pixels_within(double diameter, double aspect) {
    if (diameter > 1024)
        return std::numbers::pi / 4 * diameter * diameter / aspect;
    long count = 0;
    const int reach = static_cast<int>(diameter / 2 / std::min(1.0, aspect)) + 2;
    for (int j = -reach; j <= reach; ++j)
        for (int i = -reach; i <= reach; ++i)
            count += std::pow(2.0 * i, 2) + std::pow(2.0 * j * aspect, 2) <= diameter * diameter;
    return static_cast<double>(count);
}

struct Worst {
    double coverage = 0;
    long hidden = 0, partly = 0, reached = 0, undecided = 0;
};

void check(Picture& picture, const DofMasksOptions& options, Worst& worst) {
    const Masks got = masks_of(picture, options);
    const int width = picture.width, height = picture.height;
    const auto at = [&](int x, int y) { return static_cast<std::size_t>(y * width + x); };
    const auto c = [&](int x, int y) { return static_cast<double>(got.circle[at(x, y)]); };
    std::vector<double> share(picture.size(), 0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            if (got.near[at(x, y)] > 0)
                share[at(x, y)] = static_cast<double>(got.near[at(x, y)]) / pixels_within(-c(x, y), picture.aspect);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double reach = 0, coverage = 0;
            bool meets_near = false;
            for (int py = 0; py < height; ++py)
                for (int px = 0; px < width; ++px) {
                    const double square = std::pow(2.0 * (px - x), 2) + std::pow(2.0 * (py - y) * picture.aspect, 2);
                    const double there = c(px, py);
                    if (there < 0 && square <= there * there) {
                        reach = std::max(reach, -there);
                        coverage += share[at(px, py)];
                    }
                    meets_near = meets_near || (there < -options.sharp_px && square <= c(x, y) * c(x, y));
                }
            coverage = std::min(1.0, coverage);
            INFO(width << " x " << height << ", pixel " << x << ", " << y << ", circle " << c(x, y));
            REQUIRE(static_cast<double>(got.reach[at(x, y)]) == reach);
            const double off = std::abs(static_cast<double>(got.coverage[at(x, y)]) - coverage);
            REQUIRE(off <= near_alpha_error);
            worst.coverage = std::max(worst.coverage, off);
            const bool near = c(x, y) < -options.sharp_px;
            const bool undecided = near && std::abs(coverage - (1 - disocclusion_min_transparency)) <= near_alpha_error;
            const bool hidden = near ? coverage < 1 - disocclusion_min_transparency : meets_near; // NaN meets nothing
            if (!undecided)
                REQUIRE(static_cast<double>(got.hidden[at(x, y)]) == (hidden ? 1 : 0));
            worst.hidden += hidden;
            worst.partly += coverage > 0.01 && coverage < 0.99;
            worst.reached += reach > 0 && !(c(x, y) < 0);
            worst.undecided += undecided;
        }
    const int across = options.tile_px, columns = (width - 1) / across + 1, rows = (height - 1) / across + 1;
    REQUIRE(static_cast<int>(got.least.size()) == columns * rows);
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            float least = nan_f, greatest = nan_f;
            for (int y = row * across; y < std::min(height, (row + 1) * across); ++y)
                for (int x = column * across; x < std::min(width, (column + 1) * across); ++x) {
                    least = std::fmin(least, got.circle[at(x, y)]);
                    greatest = std::fmax(greatest, got.circle[at(x, y)]);
                }
            const auto tile = static_cast<std::size_t>(row * columns + column);
            const auto same = [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); };
            REQUIRE(same(got.least[tile], least));
            REQUIRE(same(got.greatest[tile], greatest));
        }
}

void print(const char* what, const Worst& worst) {
    std::printf("near field, %-24s coverage off by at most %.1e; %ld partly covered, %ld reached, %ld hidden, %ld "
                "undecided\n",
                what, worst.coverage, worst.partly, worst.reached, worst.hidden, worst.undecided);
}

} // namespace

TEST_CASE("near field: reach, coverage, what is hidden and tiles are what their definitions say", "[near_field]") {
    Worst worst;
    unsigned seed = 1;
    for (const double widest : {3.0, 12.0, 40.0})
        for (const double sharp : {0.0, 1.0, 4.0}) {
            Picture picture = blobs(67, 41, widest, seed++);
            check(picture, everything(sharp, sharp), worst);
        }
    print("67 x 41", worst);
    CHECK(worst.partly > 500);
    CHECK(worst.reached > 500);
    CHECK(worst.hidden > 500);
}

TEST_CASE("near field: pixels that are not square have elliptic discs", "[near_field]") {
    Worst worst;
    for (const double aspect : {0.5, 1.7}) {
        Picture picture = blobs(53, 37, 20, 40, aspect);
        check(picture, everything(), worst);
    }
    print("aspect 0.5 and 1.7", worst);
    CHECK(worst.partly > 200);
}

TEST_CASE("dof_masks: images of the caller's that do not fit are refused", "[dof_masks][near_field]") {
    const int width = 53, height = 37;
    Picture picture = blobs(width, height, 20, 9);
    const Device device = test_device();
    const StoredDepth stored{Image::from_host(device, Element::f32, picture.depth.data(), {width, height}),
                             camera_of(width, height)};
    constexpr DofMasksOptions weights{.near_weight = true, .focus_weight = true, .far_weight = true};
    const auto refused = [&](const DofMasks& given, const std::string& message) {
        CHECK_THROWS_WITH(dof_masks(stored, given, circle, weights), message);
    };
    const auto image = [&](int columns, int rows) { return Image(device, Element::f32, {columns, rows}); };
    DofMasks given{
        .coc = image(width, height), .near_weight = image(width, height), .focus_weight = image(width, height)};
    refused(given, "far_weight has no image to be written into");
    given.far_weight = image(width, height + 1);
    refused(given, "far_weight is 53 x 38 pixels; it must be 53 x 37");
    given.far_weight = Image(device, Element::f16, {width, height});
    refused(given, "far_weight holds 1 half a pixel; it must hold 1 float");
    given.far_weight = given.near_weight;
    refused(given, "far_weight shares memory with near_weight");
    given.far_weight = stored.image;
    refused(given, "far_weight shares memory with the stored depth");
    CHECK_THROWS_WITH(dof_masks(stored, {.coc = image(width, height), .near_alpha = image(width, height)}, circle),
                      "near_alpha has an image to be written into, but the options do not ask for it");
}
