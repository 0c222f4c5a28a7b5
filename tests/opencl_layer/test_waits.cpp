// Operations that follow each other on the device: the host waits once, at their end.
#include "catch.hpp"
#include "layer.hpp"
#include "operations.hpp"

#include "runtime/scratch.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

namespace {

constexpr int width = 1920, height = 1080, rounds = 9;

double milliseconds(const std::function<void()>& run) {
    const auto start = std::chrono::steady_clock::now();
    run();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
    std::ranges::sort(values);
    return values[values.size() / 2];
}

} // namespace

TEST_CASE("waits: linearize, normals, ssao and dof_masks wait once, and take no longer than each alone", "[waits]") {
    const Device device = Device::open("cpu");
    const std::vector<float> values = operations::depth(width, height);
    const StoredDepth stored{Image::from_host(device, Element::f32, values.data(), {width, height}),
                             operations::camera(width, height)};
    ViewDepth z;
    Image turned;
    Occlusion open;
    DofMasks masks;
    const std::vector<std::function<void()>> operations{
        [&] { z = linearize(stored); },
        [&] { turned = normals(z.stored()); },
        [&] { open = ssao(z.stored(), 0.5, {.normals = turned}); },
        [&] { masks = dof_masks(z.stored(), operations::lens, operations::weights); },
    };
    const auto together = [&] {
        for (const auto& run : operations)
            run();
        device.finish();
    };
    together(); // builds

    layer::reset();
    for (const auto& run : operations)
        run();
    CHECK(layer::host_waits() == 0);
    device.finish();
    CHECK(layer::host_waits() == 1);
    CHECK(layer::unfinished() == 0);
    CHECK(layer::calls("clBuildProgram") == 0);

    // A chain that waited after each operation would have the ratio 1: only the counts above show that it does not.
    constexpr double noise = 0.1; // by which two series of the same work differ where others use the machine, too
    std::vector<double> chained, alone, ratios;
    for (int round = 0; round < rounds; ++round) {
        chained.push_back(milliseconds(together));
        alone.push_back(0);
        for (const auto& run : operations)
            alone.back() += milliseconds([&] {
                run();
                device.finish();
            });
        ratios.push_back(chained.back() / alone.back());
    }
    std::printf("  together %.1f ms, the four alone %.1f ms: median ratio %.3f\n", median(chained), median(alone),
                median(ratios));
    CHECK(median(ratios) <= 1 + noise);
}

TEST_CASE("waits: rows of an image whose stride is longer are read and copied as NVIDIA's driver asks", "[waits]") {
    const Device device = Device::open("cpu");
    const int wide = 37, high = 5; // the buffer ends with the last row's pixels, and the layer refuses to read beyond
    const std::vector<float> values = operations::depth(wide, high);
    const Image given = Image::from_host(device, Element::f32, values.data(), {wide, high});
    for (const auto& [x, y, width, height] :
         {std::array{0, 0, wide, high}, std::array{3, 2, 30, 3}, std::array{5, 4, 32, 1}}) {
        CAPTURE(x, y, width, height);
        const Image own(device, Element::f32, {wide, high}), other(device, Element::f32, {wide, high});
        REQUIRE(own.row_stride() > static_cast<std::size_t>(wide));
        runtime::copy(given, own);
        runtime::copy(own.region(x, y, width, height), other.region(x, y, width, height));
        std::vector<float> result(static_cast<std::size_t>(width * height));
        other.region(x, y, width, height).download(result.data());
        for (int row = 0; row < height; ++row) // as bits, since one is NaN
            REQUIRE(std::memcmp(&result[static_cast<std::size_t>(row * width)],
                                &values[static_cast<std::size_t>((y + row) * wide + x)],
                                static_cast<std::size_t>(width) * sizeof(float)) == 0);
    }
}
