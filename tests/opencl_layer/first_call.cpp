// The time of the first call after `Device::prepare`, and of later ones, into memory that has been touched before:
//   first_call
// prints a line for each operation: its name, milliseconds of the first call on the wall and of all threads, and the medians
// of the calls after it.

#include "operations.hpp"

#include <fathom/fathom.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>
#include <utility>
#include <vector>

using namespace fathom;

namespace {

constexpr int width = 1920, height = 1080, later_calls = 5;

struct Milliseconds {
    double wall, threads;
};

double thread_milliseconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

Milliseconds time_of(const std::function<void()>& run) {
    const auto start = std::chrono::steady_clock::now();
    const double before = thread_milliseconds();
    run();
    const double threads = thread_milliseconds() - before;
    return {std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count(), threads};
}

double median(const std::vector<Milliseconds>& times, double Milliseconds::*clock) {
    std::vector<double> values;
    for (const Milliseconds& time : times)
        values.push_back(time.*clock);
    std::ranges::sort(values);
    return values[values.size() / 2];
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
        {"dof_masks",
         [&](const StoredDepth& depth) { dof_masks(depth, masks, operations::lens, operations::weights); }},
        {"dof", [&](const StoredDepth& depth) { dof(depth, color, three, operations::lens); }},
        {"fog", [&](const StoredDepth& depth) { fog(depth, color, three, {.density = 0.02}); }},
    };
    std::vector<int> other_memory(std::size_t{32} << 20);
    for (const auto& [name, call] : calls) {
        device.prepare(stored.camera, Storage::float32, call);
        const auto run = [&, &now = call] {
            now(stored);
            device.finish();
        };
        const auto from_memory = [&] { // the first call finds nothing in the caches, so none of them may
            std::ranges::fill(other_memory, other_memory[0] + 1);
            return time_of(run);
        };
        const Milliseconds first = from_memory();
        std::vector<Milliseconds> later;
        for (int i = 0; i < later_calls; ++i)
            later.push_back(from_memory());
        std::printf("%s %.4f %.4f %.4f %.4f\n", name, first.wall, first.threads, median(later, &Milliseconds::wall),
                    median(later, &Milliseconds::threads));
    }
}
