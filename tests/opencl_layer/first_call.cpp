// The time of the first call after `Device::prepare`, and of later ones, into memory that has been touched before:
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
    std::vector<std::vector<float>> memory(5, std::vector<float>(picture.size()));
    const auto result = [&](std::size_t which, int channels = 1) {
        return Image::onto_host(device, Element::f32, memory[which].data(), {width, height, channels});
    };
    const Image one = result(0), three = result(1, 3);
    const Occlusion visibility{one, {}, {}};
    DofMasks masks;
    masks.coc = one;
    masks.near_weight = result(2);
    masks.focus_weight = result(3);
    masks.far_weight = result(4);
    const std::vector<std::pair<const char*, std::function<void(const StoredDepth&)>>> calls{
        {"linearize", [&](const StoredDepth& depth) { linearize(depth, one); }},
        {"unproject", [&](const StoredDepth& depth) { unproject(depth, three); }},
        {"normals", [&](const StoredDepth& depth) { normals(depth, three); }},
        {"ssao", [&](const StoredDepth& depth) { ssao(depth, visibility, 0.5); }},
        {"dof_masks", [&](const StoredDepth& depth) { dof_masks(depth, masks, operations::lens); }},
        {"dof", [&](const StoredDepth& depth) { dof(depth, color, three, operations::lens); }},
        {"fog", [&](const StoredDepth& depth) { fog(depth, color, three, {.density = 0.02}); }},
    };
    std::vector<int> other_memory(std::size_t{64} << 20);
    for (const auto& [name, call] : calls) {
        device.prepare(stored.camera, Storage::float32, call);
        const auto run = [&, &now = call] {
            now(stored);
            device.finish();
        };
        const auto from_memory = [&] { // the first call finds nothing in the caches, so none of them may
            std::ranges::fill(other_memory, other_memory[0] + 1);
            return milliseconds(run);
        };
        const double first = from_memory();
        std::vector<double> later;
        for (int i = 0; i < later_calls; ++i)
            later.push_back(from_memory());
        std::ranges::sort(later);
        std::printf("%s %.4f %.4f\n", name, first, later[later.size() / 2]);
    }
}
