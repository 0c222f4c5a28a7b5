// Operations that follow each other on the device: the host waits once, at their end.
#include "catch.hpp"
#include "layer.hpp"
#include "operations.hpp"

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
