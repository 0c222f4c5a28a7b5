// The time of the first call after `Device::prepare`, and of later ones:
//   first_call
// prints a line for each operation: its name, milliseconds of the first call, median of the calls after it.

#include "operations.hpp"

#include <fathom/fathom.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <utility>
#include <vector>

using namespace fathom;

namespace {

constexpr int width = 960, height = 540, later_calls = 7;

double milliseconds(const std::function<void()>& run) {
    const auto start = std::chrono::steady_clock::now();
    run();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

} // namespace

int main() {
    const Device device = Device::open("cpu");
    const std::vector<float> values = operations::depth(width, height), picture(3 * values.size(), 0.25f);
    const StoredDepth stored{Image::from_host(device, Element::f32, values.data(), {width, height}),
                             operations::camera(width, height)};
    const Image color = Image::from_host(device, Element::f32, picture.data(), {width, height, 3});
    const std::vector<std::pair<const char*, std::function<void(const StoredDepth&)>>> calls{
        {"linearize", [](const StoredDepth& depth) { linearize(depth); }},
        {"unproject", [](const StoredDepth& depth) { unproject(depth); }},
        {"normals", [](const StoredDepth& depth) { normals(depth); }},
        {"ssao", [](const StoredDepth& depth) { ssao(depth, 0.5); }},
        {"dof_masks", [](const StoredDepth& depth) { dof_masks(depth, operations::lens); }},
        {"dof", [&](const StoredDepth& depth) { dof(depth, color, operations::lens); }},
        {"fog", [&](const StoredDepth& depth) { fog(depth, color, {.density = 0.02}); }},
    };
    for (const auto& [name, call] : calls) {
        device.prepare(stored.camera, Storage::float32, call);
        const auto run = [&, &now = call] {
            now(stored);
            device.finish();
        };
        const double first = milliseconds(run);
        std::vector<double> later;
        for (int i = 0; i < later_calls; ++i)
            later.push_back(milliseconds(run));
        std::ranges::sort(later);
        std::printf("%s %.4f %.4f\n", name, first, later[later.size() / 2]);
    }
}
