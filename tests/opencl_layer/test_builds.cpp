// How often programs are built: once for a context, whoever asks for them.
#include "layer.hpp"
#include "operations.hpp"
#include "own_context.hpp"

#include "runtime/opencl.hpp"

#include <fathom/fathom.hpp>

using namespace fathom;

namespace {

/// Some operations, and not all: what others build does not count here.
void work(const Device& device) {
    for (const operations::Operation& operation : operations::all())
        if (operation.name == "linearize, round 0" || operation.name == "normals, round 0" ||
            operation.name == "ssao, round 0")
            operation.run(device);
}

int builds(const Device& device) {
    layer::reset();
    work(device);
    return layer::calls("clBuildProgram");
}

} // namespace

TEST_CASE("builds: a second device of the same device builds nothing", "[builds]") {
    const Device first = Device::open("0");
    CHECK(builds(first) > 0);
    CHECK(builds(first) == 0);
    const Device second = Device::open("0");
    CHECK(builds(second) == 0);
    std::vector<std::thread> threads;
    layer::reset();
    for (int i = 0; i < 8; ++i)
        threads.emplace_back([] { work(Device::open("0")); });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(layer::calls("clBuildProgram") == 0);
}

TEST_CASE("builds: two devices build once each", "[builds]") {
    REQUIRE(list_devices().size() >= 2); // main() asks PoCL for two
    const Device one = Device::open("0"), other = Device::open("1");
    REQUIRE(one.id() != other.id());
    const int once = builds(OwnContext(one.id()).device());
    builds(one); // perhaps another case did
    CHECK(builds(other) == once);
    CHECK(builds(one) == 0);
    CHECK(builds(other) == 0);
    CHECK(builds(Device::open("0")) == 0);
    CHECK(builds(Device::open("1")) == 0);
}

TEST_CASE("builds: what most runs need together is one program", "[builds]") {
    OwnContext own(Device::open("0").id());
    const Device device = own.device();
    const auto built = [](const auto& operation) {
        layer::reset();
        operation();
        return layer::calls("clBuildProgram");
    };
    Camera camera;
    camera.projection = perspective(1.0, 1.0, {1, 4});
    camera.width = camera.height = 100;
    const std::vector<float> values(100 * 100, 0.5f);
    const StoredDepth stored{Image::from_host(device, Element::f32, values.data(), {100, 100}), camera};
    const Image z(device, Element::f32, {100, 100});
    CHECK(built([&] { linearize(stored, z); }) == 1); // with inverse depth, which all others read
    CHECK(built([&] { normals(stored); }) == 1);
    CHECK(built([&] { ssao(stored, 0.5, {.sampling = Sampling{.quality = Quality::fast}}); }) == 7);
}

TEST_CASE("builds: devices of one foreign context share what is built", "[builds]") {
    OwnContext own(Device::open("0").id());
    const Device first = own.device(); // what was built goes with the last device
    CHECK(builds(first) > 0);
    CHECK(builds(own.device()) == 0);
}

TEST_CASE("builds: eight threads that ask for the same kernels at once build each of them once", "[builds][threads]") {
    const cl_device_id id = Device::open("0").id();
    OwnContext alone(id), crowded(id);
    const int once = builds(alone.device());
    const Device shared = crowded.device();
    std::vector<std::thread> threads;
    layer::reset();
    for (int i = 0; i < 8; ++i)
        threads.emplace_back([&] { work(shared); });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(layer::calls("clBuildProgram") == once);
}
