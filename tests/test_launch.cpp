// The last parameter of every operation: events before it, an event after it, and its queue.
#include "images.hpp"
#include "own_context.hpp"
#include "test_device.hpp"

#include "runtime/launch.hpp"
#include "runtime/state.hpp"

#include <fathom/fathom.hpp>

#include <sys/wait.h>
#include <unistd.h>

using namespace fathom;
using images::floats;

namespace {

constexpr int width = 40, height = 24;
constexpr CircleOfConfusion lens{8, 16};

const Device& device() {
    static const Device opened = test_device();
    return opened;
}

Camera camera() {
    return {.projection = perspective(1.0, 1.0 * width / height, {0.5, 100}), .width = width, .height = height};
}

/// Stored depth and a picture that the operations read.
struct Inputs {
    std::vector<float> values, picture;
    StoredDepth stored;
    Image color;

    Inputs() : values(width * height), picture(3 * width * height, 0.25f) {
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = 0.5f + 0.4f * static_cast<float>(i % 97) / 97;
        stored = {Image::from_host(device(), Element::f32, values.data(), {width, height}), camera()};
        color = Image::from_host(device(), Element::f32, picture.data(), {width, height, 3});
    }
};

struct Call {
    const char* name;
    bool waits; ///< does it wait for its own kernels?
    std::function<Image(const Inputs&, const Launch&)> run;
};

const std::vector<Call> operations{
    {"linearize", false, [](const Inputs& in, const Launch& l) { return linearize(in.stored, {}, l).image; }},
    {"unproject", false, [](const Inputs& in, const Launch& l) { return unproject(in.stored, {}, l); }},
    {"normals", false, [](const Inputs& in, const Launch& l) { return normals(in.stored, {}, l); }},
    {"ssao", false, [](const Inputs& in, const Launch& l) { return ssao(in.stored, 0.5, {}, l).visibility; }},
    {"dof_masks", false, [](const Inputs& in, const Launch& l) { return dof_masks(in.stored, lens, {}, l).coc; }},
    {"fog", false, [](const Inputs& in, const Launch& l) { return fog(in.stored, in.color, {.density = 0.1}, l); }},
    {"dof", true, [](const Inputs& in, const Launch& l) { return dof(in.stored, in.color, lens, {}, l); }},
};

cl_int status_of(cl_event event) {
    cl_int status = CL_QUEUED;
    REQUIRE(clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof(status), &status, nullptr) == CL_SUCCESS);
    return status;
}

} // namespace

TEST_CASE("launch: an event in the wait list holds the operation back, and its own event completes", "[launch]") {
    for (const Call& operation : operations) {
        INFO(operation.name);
        const Inputs inputs;
        const std::vector<float> expected = floats(operation.run(inputs, {}));
        cl::UserEvent gate(runtime::context_of(device()));
        if (operation.waits) // it would wait for ever
            gate.setStatus(CL_COMPLETE);
        cl_event done = nullptr;
        const Image result = operation.run(inputs, {.queue = device().queue(), .wait = {gate()}, .event = &done});
        REQUIRE(done != nullptr);
        clFlush(device().queue());
        if (!operation.waits) {
            CHECK(status_of(done) > CL_COMPLETE);
            gate.setStatus(CL_COMPLETE);
        }
        REQUIRE(clWaitForEvents(1, &done) == CL_SUCCESS);
        CHECK(status_of(done) == CL_COMPLETE);
        clReleaseEvent(done);
        CHECK(floats(result) == expected);
    }
}

TEST_CASE("launch: a queue that is not the device's is refused", "[launch]") {
    const cl::CommandQueue other(runtime::context_of(device()), cl::Device(device().id(), true));
    for (const Call& operation : operations) {
        INFO(operation.name);
        const Inputs inputs;
        CHECK_THROWS_WITH(
            operation.run(inputs, {.queue = other()}),
            "Launch::queue is not the queue of the images' device; leave it null, or make a Device of that queue");
    }
}

TEST_CASE("launch: an event that is null, of another context or has failed is refused", "[launch]") {
    OwnContext other(device().id());
    const Device elsewhere = other.device();
    cl::UserEvent of_other(runtime::context_of(elsewhere)), failed(runtime::context_of(device()));
    failed.setStatus(-5);
    for (const Call& operation : operations) {
        INFO(operation.name);
        const Inputs inputs;
        const auto run = [&](cl_event event) { operation.run(inputs, {.wait = {event}}); };
        CHECK_THROWS_AS(run(nullptr), std::invalid_argument);
        CHECK_THROWS_AS(run(of_other()), std::invalid_argument);
        CHECK_THROWS_WITH(run(failed()), "Launch::wait holds an event that has failed: its status is -5");
    }
    of_other.setStatus(CL_COMPLETE);
    device().finish();
}

TEST_CASE("launch: an exception waits for the kernels that were started", "[launch]") {
    const Inputs inputs;
    const Image result(device(), Element::f32, {width, height});
    cl_event started = nullptr;
    try {
        const runtime::Launched launched(device());
        linearize(inputs.stored, result, {}, {.event = &started});
        throw std::runtime_error("half way");
    } catch (const std::runtime_error&) {
        CHECK(status_of(started) == CL_COMPLETE);
    }
    clReleaseEvent(started);
}

TEST_CASE("launch: in a forked process every operation on images of before is refused, whatever a thread had locked",
          "[launch]") {
    const Inputs inputs;
    for (const Call& operation : operations)
        operation.run(inputs, {});
    device().finish();
    runtime::Context& shared = *device().state().shared;
    const std::scoped_lock as_another_thread(device().state().mutex, shared.programs_mutex, shared.kept_mutex);
    for (const Call& operation : operations) {
        INFO(operation.name);
        const pid_t child = fork();
        REQUIRE(child >= 0);
        if (child == 0) {
            alarm(20);
            try {
                operation.run(inputs, {});
                _exit(1);
            } catch (const Error&) {
                _exit(0);
            } catch (...) {
                _exit(2);
            }
        }
        int status = -1;
        REQUIRE(waitpid(child, &status, 0) == child);
        CHECK(status == 0);
    }
}

TEST_CASE("launch: a device takes part in a context without keeping it too short or too long", "[launch]") {
    const auto references = [](cl_context context) {
        cl_uint count = 0;
        clGetContextInfo(context, CL_CONTEXT_REFERENCE_COUNT, sizeof(count), &count, nullptr);
        return count;
    };
    const auto owners = [](cl_mem buffer) {
        cl_uint count = 0;
        clGetMemObjectInfo(buffer, CL_MEM_REFERENCE_COUNT, sizeof(count), &count, nullptr);
        return count;
    };
    const cl::Context context(cl::Device(device().id(), true));
    cl::CommandQueue queue(context, cl::Device(device().id(), true));
    const cl_uint before = references(context());
    {
        const Device own(context(), device().id(), queue());
        CHECK(references(context()) > before);
        const cl::Buffer buffer(context, CL_MEM_READ_WRITE, 4096);
        {
            const Image image(own, buffer(), Element::f32, {8, 4});
            const Image copy = image.region(1, 1, 2, 2);
            CHECK(owners(buffer()) == 2);
        }
        CHECK(owners(buffer()) == 1);
    }
    CHECK(references(context()) == before);
    const auto refused = [&](cl_context of, cl_command_queue with) {
        CHECK_THROWS_AS(Device(of, device().id(), with), std::invalid_argument);
    };
    refused(nullptr, queue());
    refused(context(), nullptr);
    refused(device().context(), queue()); // another context's
}

TEST_CASE("launch: images of two devices are refused", "[launch]") {
    const Inputs inputs;
    const Device beside = test_device();
    const std::string other_queue =
        " belongs to another Device than the stored depth, with a queue of its own; open one "
        "Device for both";
    CHECK(beside.context() == device().context());
    CHECK_THROWS_WITH(linearize(inputs.stored, Image(beside, Element::f32, {width, height})),
                      "the result" + other_queue);
    CHECK_THROWS_WITH(dof(inputs.stored, Image(beside, Element::f32, {width, height, 3}), lens), "color" + other_queue);

    const cl::Context context(cl::Device(device().id(), true));
    const cl::CommandQueue queue(context, cl::Device(device().id(), true));
    const Device other(context(), device().id(), queue());
    CHECK_THROWS_WITH(linearize(inputs.stored, Image(other, Element::f32, {width, height})),
                      "the result lies on another device than the stored depth");
}

TEST_CASE("launch: a queue that is out of order gives the same bits", "[launch]") {
    const cl::Device id(device().id(), true);
    const cl::CommandQueue any_order(cl::Context(device().context(), true), id, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
    const Device own(device().context(), device().id(), any_order());
    const Inputs inputs;
    Inputs there;
    there.stored.image = Image::from_host(own, Element::f32, there.values.data(), {width, height});
    there.color = Image::from_host(own, Element::f32, there.picture.data(), {width, height, 3});
    for (const Call& operation : operations) {
        INFO(operation.name);
        CHECK(floats(operation.run(there, {})) == floats(operation.run(inputs, {})));
    }
}

TEST_CASE("launch: prepare runs the call once, on depth of every value, and its exception arrives", "[launch]") {
    int runs = 0;
    for (const Storage storage : {Storage::float32, Storage::float16, Storage::uint8, Storage::uint16, Storage::uint24,
                                  Storage::uint24_high, Storage::rgb8_red_high})
        device().prepare(camera(), storage, [&](const StoredDepth& stored) {
            ++runs;
            const std::vector<float> z = floats(linearize(stored).image);
            CHECK(std::ranges::count_if(z, [](float each) { return std::isfinite(each); }) > width * height / 2);
            CHECK(std::ranges::max(z) > 10);
        });
    CHECK(runs == 7);
    CHECK_THROWS_AS(device().prepare({}, Storage::float32, [](const StoredDepth&) {}), std::invalid_argument);
    CHECK_THROWS_AS(device().prepare(camera(), Storage::float32, [](const StoredDepth& stored) { ssao(stored, -1); }),
                    std::invalid_argument);
}

TEST_CASE("launch: a Device that is none yet is refused", "[launch]") {
    CHECK_THROWS_AS(Device().finish(), std::invalid_argument);
    CHECK_THROWS_AS(Image(Device(), Element::f32, {4, 4}), std::invalid_argument);
}
