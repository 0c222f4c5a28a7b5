// `reach` and `bytes` where they are more than nothing: a tile with its reach around it has the bits of the whole image, and a device
// with so much memory does a call as one without a budget does.
#include "catch.hpp"
#include "images.hpp"
#include "runtime/state.hpp"
#include "test_device.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;
using namespace fathom::images;

namespace {

constexpr int width = 430, height = 410;
constexpr double nearest = 3.8, radius = 0.15; // 16 pixels at the nearest surface

// Pixels that are higher than wide, and surfaces with steps, slopes and a few invalid pixels.
struct Scene {
    Camera camera;
    std::vector<float> depth, color;

    Scene() {
        camera.projection = perspective(1.0, 1.2 * width / height, {0.5, 100});
        camera.width = width;
        camera.height = height;
        camera.encoding = Encoding::view_z;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const double hills = 4.0 + 0.2 * std::sin(0.11 * x) * std::cos(0.07 * y);
                const bool hole = (x * 31 + y * 17) % 997 == 0;
                depth.push_back(hole ? std::nanf("") : static_cast<float>((x / 40 + y / 50) % 3 ? hills : hills + 2));
                for (int channel = 0; channel < 3; ++channel)
                    color.push_back(static_cast<float>((7 * x + 5 * y + 3 * channel) % 32) / 32);
            }
    }
    StoredDepth stored(const Device& device) const {
        return {Image::from_host(device, Element::f32, depth.data(), {width, height}), camera};
    }
    Image picture(const Device& device) const {
        return Image::from_host(device, Element::f32, color.data(), {width, height, 3});
    }
};

struct Subject {
    std::string name;
    Reach reach;
    std::size_t bytes;
    std::function<std::vector<Image>(const StoredDepth&, const Image& color)> run;
};

std::vector<std::vector<float>> all_floats(const std::vector<Image>& images, const Region& part) {
    std::vector<std::vector<float>> all;
    for (const Image& image : images)
        all.push_back(floats(image.region(part.x, part.y, part.width, part.height)));
    return all;
}

void check(const Scene& scene, const Subject& subject) {
    INFO(subject.name);
    const Device device = test_device();
    const StoredDepth stored = scene.stored(device);
    const Image color = scene.picture(device);
    const std::vector<Image> whole = subject.run(stored, color);
    const auto& [columns, rows] = subject.reach;
    for (const Region& tile :
         {Region{183, 171, 61, 53}, {0, 0, 40, 30}, {397, 381, 33, 29}, {5, 201, 37, 1}, {202, 3, 1, 44}}) {
        const int left = std::max(tile.x - columns, 0), top = std::max(tile.y - rows, 0),
                  right = std::min(tile.x + tile.width + columns, width),
                  bottom = std::min(tile.y + tile.height + rows, height);
        const std::vector<Image> part = subject.run(stored.region(left, top, right - left, bottom - top),
                                                    color.region(left, top, right - left, bottom - top));
        INFO("tile " << tile.width << " x " << tile.height << " at " << tile.x << ", " << tile.y);
        CHECK(std::ranges::equal(all_floats(part, {tile.x - left, tile.y - top, tile.width, tile.height}),
                                 all_floats(whole, tile),
                                 [](const auto& a, const auto& b) { return same_bits(a, b); }));
    }
    const std::size_t taken = device.state().most_scratch_bytes;
    std::printf("%s: reads %d columns and %d rows around a tile; takes %.2f MiB, %.2f at most\n", subject.name.c_str(),
                columns, rows, static_cast<double>(taken) / (1 << 20), static_cast<double>(subject.bytes) / (1 << 20));
    const Device bounded = test_device({.memory_budget = std::max<std::size_t>(subject.bytes, 1)});
    const std::vector<Image> again = subject.run(scene.stored(bounded), scene.picture(bounded));
    CHECK(std::ranges::equal(all_floats(again, {0, 0, width, height}), all_floats(whole, {0, 0, width, height}),
                             [](const auto& a, const auto& b) { return same_bits(a, b); }));
    CHECK(bounded.state().most_scratch_bytes <= subject.bytes);
}

} // namespace

TEST_CASE("tiles: reach and bytes are enough", "[tiles]") {
    const Scene scene;
    const Tile tile(scene.camera, Storage::float32, {0, 0, width, height});
    std::vector<Subject> subjects;
    for (const NormalsOptions& options : {NormalsOptions{}, NormalsOptions{.method = NormalMethod::least_squares},
                                          NormalsOptions{.noise = 1e-3}, NormalsOptions{.method = MaxError{45}}})
        subjects.push_back(
            {"normals", reach(tile, options), bytes(tile, options),
             [=](const StoredDepth& depth, const Image&) { return std::vector{normals(depth, options)}; }});

    const CircleOfConfusion lens{40, 180};
    const StoredDepth stored = scene.stored(test_device());
    const double widest = static_cast<double>(widest_coc(stored, lens));
    CHECK(widest > 5);
    CHECK(widest < 20);
    const DofMasksOptions masks{.near_weight = true, .max_near_coc = true, .mixed_pixels = true},
        alpha{.near_alpha = true};
    subjects.push_back(
        {"dof_masks", reach(tile, masks, widest), bytes(tile, masks), [=](const StoredDepth& depth, const Image&) {
             const DofMasks all = dof_masks(depth, lens, masks);
             return std::vector{all.coc, all.near_weight, all.max_near_coc, all.mixed_pixels};
         }});
    subjects.push_back({
        "dof_masks with near alpha",
        reach(tile, alpha, widest),
        bytes(tile, alpha),
        [=](const StoredDepth& depth, const Image&) { return std::vector{dof_masks(depth, lens, alpha).near_alpha}; },
    });
    for (const Quality quality : {Quality::fast, Quality::balanced, Quality::accurate}) {
        const DofOptions options{.quality = quality};
        subjects.push_back({"dof", reach(tile, options, widest), bytes(tile, 3, options, widest),
                            [=](const StoredDepth& depth, const Image& color) {
                                return std::vector{dof(depth, color, lens, options)};
                            }});
    }
    for (const auto& subject : subjects)
        check(scene, subject);
}

TEST_CASE("tiles: ssao's reach and bytes are enough", "[tiles][slow]") {
    const Scene scene;
    const Tile tile(scene.camera, Storage::float32, {0, 0, width, height});
    const StoredDepth stored = scene.stored(test_device());
    for (const auto& [name, options] :
         {std::pair{"ssao, all pixels", SsaoOptions{.sampling = Sampling{.half_resolution = false}}},
          {"ssao at half resolution", SsaoOptions{.sampling = Sampling{.half_resolution = true}}},
          {"ssao of a quality", SsaoOptions{.sampling = Sampling{.quality = Quality::fast}}},
          {"ssao with a constant thickness",
           SsaoOptions{.sampling = Sampling{.quality = Quality::fast, .half_resolution = false}, .thickness = 0.1}},
          {"ssao with an error", SsaoOptions{.sampling = MaxError{0.2}}}}) {
        const Reach bound = reach(tile, radius, options, nearest), found = reach(stored, radius, options);
        CHECK(found.columns <= bound.columns);
        CHECK(found.rows <= bound.rows);
        CHECK(bound.rows < 180);
        check(scene, {name, found, bytes(tile, options), [options = options](const StoredDepth& depth, const Image&) {
                          return std::vector{ssao(depth, radius, options).visibility};
                      }});
    }
}

TEST_CASE("tiles: how far ssao looks grows with the nearness of surfaces, up to the whole image", "[tiles]") {
    const Scene scene;
    const Tile tile(scene.camera, Storage::float32, {0, 0, width, height});
    const SsaoOptions options;
    Reach last;
    for (const double depth : {100.0, 10.0, 2.0, 0.5, 0.16, 0.1}) {
        const Reach found = reach(tile, radius, options, depth);
        CHECK(found.columns >= last.columns);
        CHECK(found.rows >= last.rows);
        last = found;
    }
    CHECK(last.columns == width);
    CHECK(last.rows == height);
    CHECK_THROWS_WITH(reach(tile, radius, options, -1), "nearest = -1 does not lie before the camera");
    Camera parallel = scene.camera;
    parallel.projection = orthographic({-2, 2, -2, 2}, {0.5, 100});
    const Tile other(parallel, Storage::float32, {0, 0, width, height});
    CHECK(reach(other, radius, options, 1).rows == reach(other, radius, options, 50).rows);
    CHECK_THROWS_AS(reach(tile, 0, options, 1), std::invalid_argument);
}
