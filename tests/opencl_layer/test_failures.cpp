// A failure of every call to OpenCL that can fail, one after the other, in every operation.
#include "faults.hpp"
#include "layer.hpp"
#include "operations.hpp"

#include "runtime/opencl.hpp"

#include <fathom/fathom.hpp>

#include <cstdlib>

using namespace fathom;
using operations::Bytes;

namespace {

/// Found without the library, so that it keeps nothing open.
cl_device_id cpu() {
    cl_platform_id platform = nullptr;
    cl_device_id device = nullptr;
    REQUIRE(clGetPlatformIDs(1, &platform, nullptr) == CL_SUCCESS);
    REQUIRE(clGetDeviceIDs(platform, CL_DEVICE_TYPE_CPU, 1, &device, nullptr) == CL_SUCCESS);
    return device;
}

/// Everything runs in this context. What the library keeps of it goes with its last device.
cl_context context() {
    static const cl_device_id device = cpu();
    static const cl_context made = clCreateContext(nullptr, 1, &device, nullptr, nullptr, nullptr);
    return made;
}

/// A device for which nothing was built or allocated yet.
class Fresh {
public:
    Fresh() : queue_(clCreateCommandQueue(context(), cpu(), 0, nullptr)), device_(context(), cpu(), queue_) {}
    ~Fresh() { clReleaseCommandQueue(queue_); }
    Fresh(const Fresh&) = delete;
    Fresh& operator=(const Fresh&) = delete;

    const Device& device() const { return device_; }

private:
    cl_command_queue queue_;
    Device device_;
};

// An optional extension says the names of arguments' types, and drivers need not have it. The operation does without.
// Of devices that do not answer, others are left to choose from.
const std::set<std::string> done_without{"clGetKernelArgInfo", "clGetPlatformIDs", "clGetPlatformInfo",
                                         "clGetDeviceIDs", "clGetDeviceInfo"};

/// What became of a call in which something failed.
struct Outcome {
    std::optional<Bytes> result;
    std::string exception; // empty: none
    bool of_fathom = false;
};

template <typename Call>
Outcome outcome(const Call& call) {
    Outcome seen;
    try {
        seen.result = call();
    } catch (const Error& error) {
        seen.exception = error.what();
        seen.of_fathom = true;
    } catch (const std::exception& error) {
        seen.exception = error.what();
    } catch (...) {
        seen.exception = "something that is no exception";
    }
    return seen;
}

/// FATHOM_EVERY=N tries every Nth point of failure; operations begin at different ones.
std::size_t every() {
    const char* text = std::getenv("FATHOM_EVERY");
    return text ? std::stoul(text) : 1;
}

/// Runs `run` in a fresh context once for each point of failure from the first on, and once more when the failure is over.
void fail_everywhere(const operations::Operation& operation, layer::Failure failure, std::size_t first, Faults& faults,
                     int& tried) {
    Bytes expected;
    std::vector<std::string> points;
    operation.run(Fresh().device()); // what is kept until the process ends is there now
    {
        const Fresh fresh;
        layer::reset();
        expected = operation.run(fresh.device());
        points = layer::points();
    }
    const std::string before = layer::held();
    for (std::size_t point = first; point < points.size(); point += every()) {
        const std::string where = operation.name + ": " + points[point] +
                                  (failure == layer::Failure::once ? " fails" : " and everything after it fails");
        {
            const Fresh fresh;
            layer::fail(point, failure);
            const Outcome seen = outcome([&] { return operation.run(fresh.device()); });
            faults.check(layer::unfinished() == 0, where + ", and commands still run when the call has ended");
            faults.check(layer::freed_too_early().empty(), where + ", and " + layer::freed_too_early());
            const std::vector<std::string> reached = layer::points();
            layer::reset();
            if (reached.size() <= point || reached[point] != points[point])
                faults.check(false, where + ", but the call took another way");
            if (seen.result)
                faults.check(done_without.contains(points[point]) && seen.result == expected,
                             where + ", and the call succeeds");
            else
                faults.check(seen.of_fathom, where + ", and what comes out is no fathom::Error: " + seen.exception);
            const Outcome next = outcome([&] { return operation.run(fresh.device()); });
            faults.check(next.result.has_value(), where + ", and so does the next call: " + next.exception);
            faults.check(!next.result || next.result == expected, where + ", and the next call has other bits");
        }
        faults.check(layer::held() == before, where + ", and the program holds " + layer::held() + ", not " + before);
        ++tried;
    }
}

void fail_everywhere(const std::vector<operations::Operation>& list, layer::Failure failure) {
    REQUIRE(context() != nullptr);
    REQUIRE(layer::loaded());
    std::size_t first = 0;
    for (const operations::Operation& operation : list) {
        first = (first + 1) % every();
        DYNAMIC_SECTION(operation.name << (failure == layer::Failure::once ? "" : ", for good")) {
            const auto start = std::chrono::steady_clock::now();
            Faults faults;
            int tried = 0;
            fail_everywhere(operation, failure, first, faults, tried);
            CHECK(tried > 0);
            std::printf("  %-40s %4d points, %5.1f s\n", operation.name.c_str(), tried,
                        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
    }
}

/// What the devices say of themselves, without which none is opened.
Bytes names() {
    std::string all;
    for (const DeviceInfo& info : list_devices())
        all += info.name + info.platform + info.version;
    return {all.begin(), all.end()};
}

const std::vector<operations::Operation> opening{
    {"Device::open", [](const Device&) { return operations::all().front().run(Device::open("cpu")); }},
    {"Device of another's queue",
     [](const Device& other) {
         return operations::all().front().run(Device(other.context(), other.id(), other.queue()));
     }},
};

} // namespace

TEST_CASE("failures: one call fails", "[failures]") {
    fail_everywhere(operations::all(), layer::Failure::once);
}

TEST_CASE("failures: the device is lost", "[failures][lost]") {
    fail_everywhere(operations::all(), layer::Failure::from_here);
}

TEST_CASE("failures: scratch memory in huge pages", "[failures]") {
    fail_everywhere({operations::in_huge_pages()}, layer::Failure::once);
}

TEST_CASE("failures: the process's own context of a device is made", "[failures]") {
    REQUIRE(list_devices().size() > 1);
    for (std::size_t point = 0;; ++point) { // until the context is there
        layer::fail(point, layer::Failure::once);
        const Outcome seen = outcome([] {
            Device::open("1").finish();
            return Bytes();
        });
        const std::vector<std::string> points = layer::points();
        layer::reset();
        if (points.size() <= point) {
            CHECK(seen.result);
            break;
        }
        INFO(points[point] << " fails: " << seen.exception);
        CHECK((seen.of_fathom || (seen.result && done_without.contains(points[point]))));
    }
}

TEST_CASE("failures: a device that is opened", "[failures]") {
    operations::all().front().run(Device::open("1")); // which is taken where the other one does not answer
    fail_everywhere(opening, layer::Failure::once);
    fail_everywhere(opening, layer::Failure::from_here);
}

TEST_CASE("failures: a list of devices without one that does not answer", "[failures]") {
    layer::reset();
    const Bytes everything = names();
    const std::size_t points = layer::points().size();
    REQUIRE(points > 0);
    for (const layer::Failure failure : {layer::Failure::once, layer::Failure::from_here})
        for (std::size_t point = 0; point < points; ++point) {
            layer::fail(point, failure);
            const Outcome seen = outcome(names);
            INFO(layer::points()[point] << " fails: " << seen.exception);
            layer::reset();
            CHECK((seen.result || seen.of_fathom)); // it is left out, or the whole list is refused
            CHECK(names() == everything);
        }
}
