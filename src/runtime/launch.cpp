// Kernels are checked and started. And where an operation stands among other work: events before it, an event after it, and no
// kernel left behind by an exception.

#include "runtime/launch.hpp"

#include "require.hpp"

#include <algorithm>
#include <exception>
#include <utility>

namespace fathom::runtime {

std::string bare_type(std::string_view reported) {
    std::string type(reported.substr(0, reported.find('\0')));
    for (const std::string_view part : {"__global", "global", "__private", "const", "struct", "restrict", " "})
        for (auto at = type.find(part); at != std::string::npos; at = type.find(part))
            type.erase(at, part.size());
    return type;
}

void check(Kernel& kernel, const std::vector<std::string>& types) {
    const auto declared = kernel.kernel.getInfo<CL_KERNEL_NUM_ARGS>();
    if (declared != types.size()) {
        throw Error(text(kernel.description, " takes ", declared, " arguments and was given ", types.size()));
    }
    for (cl_uint i = 0; i < declared; ++i) {
        std::string type;
        try {
            type = bare_type(kernel.kernel.getArgInfo<CL_KERNEL_ARG_TYPE_NAME>(i));
        } catch (const cl::Error&) {
            break; // a driver that keeps no names
        }
        if (type != types[i]) {
            throw Error(text(kernel.description, ": argument ", i, " is a ", type, " and was given a ", types[i]));
        }
    }
}

std::size_t group_size(const Device& device, Kernel& kernel) {
    if (kernel.group_limit == 0)
        kernel.group_limit = kernel.kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device.state().shared->device);
    return std::min(static_cast<std::size_t>(device.options().group_size), kernel.group_limit);
}

namespace {

// Drivers differ in what they do with an event that has failed: PoCL waits for ever.
void check_event(const Device& device, const cl::Event& event) {
    require(event() != nullptr, "Launch::wait holds a null event");
    require(event.getInfo<CL_EVENT_CONTEXT>() == context_of(device),
            "Launch::wait holds an event of another context than ", device.info().name, "'s");
    const cl_int status = event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>();
    require<Error>(status >= 0, "Launch::wait holds an event that has failed: its status is ", status);
}

} // namespace

Launched::Launched(const Device& device, const Launch& launch)
    : device_(device), event_(launch.event), exceptions_(std::uncaught_exceptions()) {
    check_thread();
    const cl_command_queue own = device.queue(); // which only a device that is open has
    require(!launch.queue || launch.queue == own,
            "Launch::queue is not the queue of the images' device; leave it null, or make a Device of that queue");
    if (launch.wait.empty())
        return;
    const auto wait = [&] {
        std::vector<cl::Event> events;
        for (const cl_event event : launch.wait)
            check_event(device, events.emplace_back(event, true));
        queue_of(device).enqueueBarrierWithWaitList(&events);
    };
    ask(device, wait, "refused the events to wait for");
}

void Launched::done() const {
    if (!event_)
        return;
    cl::Event made;
    const auto mark = [&] { queue_of(device_).enqueueMarkerWithWaitList(nullptr, &made); };
    ask(device_, mark, "refused an event");
    *event_ = std::exchange(made(), nullptr); // which the caller releases
}

Launched::~Launched() {
    if (std::uncaught_exceptions() > exceptions_)
        clFinish(device_.queue()); // its error code is dropped: an exception is already on its way
}

} // namespace fathom::runtime
