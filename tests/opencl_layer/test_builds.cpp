// How often programs are built: once for a context, whoever asks for them.
#include "catch.hpp"
#include "layer.hpp"
#include "operations.hpp"

#include "runtime/opencl.hpp"

#include <algorithm>
#include <fathom/fathom.hpp>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

using namespace fathom;

namespace {

/// Some operations, and not all: what others build does not count here.
void work(const Device& device) {
    for (const operations::Operation& operation : operations::all()) {
        if (operation.name == "linearize" || operation.name == "normals" || operation.name == "ssao")
            operation.run(device);
    }
}

int builds(const Device& device) {
    layer::reset();
    work(device);
    return layer::calls("clBuildProgram");
}

/// A queue of a context of its own.
struct Foreign {
    cl_context context;
    cl_command_queue queue;
    cl_device_id id;

    explicit Foreign(cl_device_id device)
        : context(clCreateContext(nullptr, 1, &device, nullptr, nullptr, nullptr)),
          queue(clCreateCommandQueue(context, device, 0, nullptr)), id(device) {
        REQUIRE(queue != nullptr);
    }
    ~Foreign() {
        clReleaseCommandQueue(queue);
        clReleaseContext(context);
    }
    Foreign(const Foreign&) = delete;
    Foreign& operator=(const Foreign&) = delete;
};

double median(std::vector<double> values) {
    std::ranges::sort(values);
    return values[values.size() / 2];
}

constexpr int processes = 3;

/// The first call may take this many times as long as later ones.
constexpr double prepared = 1.2;

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
    if (list_devices().size() < 2) {
        WARN("skipped: one device only; POCL_DEVICES=\"pthread pthread\" makes two");
        return;
    }
    const Device one = Device::open("0"), other = Device::open("1");
    REQUIRE(one.id() != other.id());
    const Foreign count_here(one.id());
    const int once = builds(Device(count_here.context, count_here.id, count_here.queue));
    builds(one); // perhaps another case did
    CHECK(builds(other) == once);
    CHECK(builds(one) == 0);
    CHECK(builds(other) == 0);
    CHECK(builds(Device::open("0")) == 0);
    CHECK(builds(Device::open("1")) == 0);
}

TEST_CASE("builds: devices of one foreign context share what is built", "[builds]") {
    const Foreign own(Device::open("0").id());
    const Device first(own.context, own.id, own.queue);
    CHECK(builds(first) > 0);
    const cl_command_queue another = clCreateCommandQueue(own.context, own.id, 0, nullptr);
    const Device second(own.context, own.id, another);
    CHECK(builds(second) == 0);
    clReleaseCommandQueue(another);
}

TEST_CASE("builds: eight threads that ask for the same kernels at once build each of them once", "[builds][threads]") {
    const cl_device_id id = Device::open("0").id();
    const Foreign alone(id), crowded(id);
    const int once = builds(Device(alone.context, id, alone.queue));
    const Device shared(crowded.context, id, crowded.queue);
    std::vector<std::thread> threads;
    layer::reset();
    for (int i = 0; i < 8; ++i)
        threads.emplace_back([&] { work(shared); });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(layer::calls("clBuildProgram") == once);
}

TEST_CASE("builds: after prepare the first call is as fast as the second", "[builds][prepare]") {
    std::map<std::string, std::vector<double>> ratios;
    for (int i = 0; i < processes; ++i) {
        const std::filesystem::path cache = std::filesystem::temp_directory_path() /
                                            ("fathom-prepare-" + std::to_string(getpid()) + "-" + std::to_string(i));
        std::filesystem::remove_all(cache);
        std::filesystem::create_directory(cache);
        const std::string command = "env -u OPENCL_LAYERS POCL_CACHE_DIR=" + cache.string() + " " FATHOM_FIRST_CALL;
        FILE* const output = popen(command.c_str(), "r");
        REQUIRE(output != nullptr);
        std::string printed;
        for (int c = std::fgetc(output); c != EOF; c = std::fgetc(output))
            printed += static_cast<char>(c);
        const int status = pclose(output);
        std::filesystem::remove_all(cache);
        INFO(printed);
        REQUIRE(status == 0);
        std::istringstream lines(printed);
        std::string name;
        for (double first = 0, later = 0; lines >> name >> first >> later;)
            ratios[name].push_back(first / later);
    }
    CHECK(ratios.size() == 7);
    for (const auto& [name, all] : ratios) {
        // The least: what is built late is built in every process, and other work on the machine is not.
        const double least = std::ranges::min(all);
        std::printf("  %-12s the first call takes %.2f times as long as later ones, at least %.2f\n", name.c_str(),
                    median(all), least);
        INFO(name);
        CHECK(least <= prepared);
    }
}
