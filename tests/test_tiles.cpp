// `reach` and `bytes` of ssao: a tile with its reach around it has the bits of the whole image, and a device
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
    std::vector<float> depth;

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
            }
    }
    StoredDepth stored(const Device& device) const {
        return {Image::from_host(device, Element::f32, depth.data(), {width, height}), camera};
    }
};

struct Subject {
    std::string name;
    Reach reach;
    std::size_t bytes;
    std::function<Image(const StoredDepth&)> run;
};

std::vector<float> floats_of(const Image& image, const Region& part) {
    return floats(image.region(part.x, part.y, part.width, part.height));
}

void check(const Scene& scene, const Subject& subject) {
    INFO(subject.name);
    const Device device = test_device();
    const StoredDepth stored = scene.stored(device);
    const Image whole = subject.run(stored);
    const auto& [columns, rows] = subject.reach;
    for (const Region& tile :
         {Region{183, 171, 61, 53}, {0, 0, 40, 30}, {397, 381, 33, 29}, {5, 201, 37, 1}, {202, 3, 1, 44}}) {
        const int left = std::max(tile.x - columns, 0), top = std::max(tile.y - rows, 0),
                  right = std::min(tile.x + tile.width + columns, width),
                  bottom = std::min(tile.y + tile.height + rows, height);
        const Image part = subject.run(stored.region(left, top, right - left, bottom - top));
        INFO("tile " << tile.width << " x " << tile.height << " at " << tile.x << ", " << tile.y);
        CHECK(
            same_bits(floats_of(part, {tile.x - left, tile.y - top, tile.width, tile.height}), floats_of(whole, tile)));
    }
    const std::size_t taken = device.state().most_scratch_bytes;
    std::printf("%s: reads %d columns and %d rows around a tile; takes %.2f MiB, %.2f at most\n", subject.name.c_str(),
                columns, rows, static_cast<double>(taken) / (1 << 20), static_cast<double>(subject.bytes) / (1 << 20));
    const Device bounded = test_device({.memory_budget = std::max<std::size_t>(subject.bytes, 1)});
    CHECK(same_bits(floats(subject.run(scene.stored(bounded))), floats(whole)));
    CHECK(bounded.state().most_scratch_bytes <= subject.bytes);
}

} // namespace

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
        check(scene, {name, found, bytes(tile, options), [options = options](const StoredDepth& depth) {
                          return ssao(depth, radius, options).visibility;
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
