// Many threads, one or two devices: every call gives the bits that it gives alone.
#include "faults.hpp"
#include "operations.hpp"
#include "own_context.hpp"

#include <fathom/fathom.hpp>

#include <atomic>
#include <barrier>
#include <cstdlib>

using namespace fathom;
using operations::Bytes;

namespace {

// Before the first call of OpenCL: PoCL's device twice.
const bool two_devices = setenv("POCL_DEVICES", "pthread pthread", 1) == 0;

#ifdef __SANITIZE_THREAD__
constexpr int calls = 60; // each takes ten times as long, and a race shows without a clash
#else
constexpr int calls = 200;
#endif
constexpr int threads = 8;

/// What every operation gives, called alone.
const std::vector<Bytes>& expected() {
    static const std::vector<Bytes> all = [] {
        const Device device = Device::open("0");
        std::vector<Bytes> results;
        for (const operations::Operation& operation : operations::all())
            results.push_back(operation.run(device));
        return results;
    }();
    return all;
}

void at_once(const std::function<void(int)>& run) {
    std::barrier start(threads);
    std::vector<std::thread> all;
    for (int thread = 0; thread < threads; ++thread)
        all.emplace_back([&, thread] {
            start.arrive_and_wait();
            run(thread);
        });
    for (std::thread& each : all)
        each.join();
}

void call(const Device& device, std::size_t which, Faults& faults) {
    const operations::Operation& operation = operations::all()[which];
    try {
        if (operation.run(device) != expected()[which])
            faults.add(operation.name + " has other bits");
    } catch (const std::exception& error) {
        faults.add(operation.name + ": " + error.what());
    }
}

/// Every thread calls every operation, each in another order, on the device of its turn.
void mixed_calls(const std::vector<Device>& devices) {
    expected();
    Faults faults;
    std::atomic<int> made = 0;
    at_once([&](int thread) {
        const std::size_t count = operations::all().size();
        for (int i = 0; i < calls; ++i) {
            const auto n = static_cast<std::size_t>(thread * 7 + i * (i / static_cast<int>(count) % 2 == 0 ? 1 : 5));
            call(devices[static_cast<std::size_t>(thread + i) % devices.size()], n % count, faults);
            ++made;
        }
    });
    CHECK(made == threads * calls);
}

} // namespace

TEST_CASE("threads: eight threads share one device", "[threads]") {
    mixed_calls({Device::open("0")});
}

TEST_CASE("threads: eight threads share two devices of one context", "[threads]") {
    OwnContext context(Device::open("0").id());
    mixed_calls({context.device(), context.device()});
}

TEST_CASE("threads: eight threads share two devices", "[threads]") {
    REQUIRE(list_devices().size() >= 2); // main() asks PoCL for two
    mixed_calls({Device::open("0"), Device::open("1")});
}

TEST_CASE("threads: the first call of eight threads is the same one, on a device where nothing is built", "[threads]") {
    expected();
    for (std::size_t which = 0; which < operations::all().size(); which += 4) {
        OwnContext context(Device::open("0").id());
        const Device device = context.device();
        Faults faults;
        at_once([&](int) { call(device, which, faults); });
    }
}

TEST_CASE("threads: eight threads open and leave devices", "[threads]") {
    expected();
    Faults faults;
    at_once([&](int thread) {
        for (int i = 0; i < 10; ++i) {
            if (list_devices().empty())
                faults.add("no device");
            call(Device::open((thread + i) % 2 == 0 ? "cpu" : "0"), static_cast<std::size_t>(i % 3), faults);
        }
    });
}

TEST_CASE("threads: images that one thread makes are read by another", "[threads]") {
    const Device device = Device::open("0");
    const std::vector<float> values = operations::depth(40, 24);
    const StoredDepth stored{Image::from_host(device, Element::f32, values.data(), {40, 24}),
                             operations::camera(40, 24)};
    ViewDepth z;
    std::thread([&] { z = linearize(stored); }).join();
    std::vector<std::vector<float>> seen(threads, std::vector<float>(values.size()));
    at_once([&](int thread) { z.image.download(seen[static_cast<std::size_t>(thread)].data()); });
    std::vector<float> alone(values.size());
    linearize(stored).image.download(alone.data());
    alone.front() = 0; // NaN
    for (std::vector<float>& each : seen) {
        each.front() = 0;
        CHECK(each == alone);
    }
}
