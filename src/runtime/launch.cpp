// Kernels are checked and started. And where an operation stands among other work: events before it, an event after it, and no
// kernel left behind by an exception.

#include "runtime/launch.hpp"

#include "require.hpp"

#include <algorithm>
#include <array>
#include <exception>

namespace fathom::runtime {

std::string bare_type(std::string_view reported) {
    constexpr std::array<std::string_view, 6> qualifiers{"__global", "global", "__private",
                                                         "const",    "struct", "restrict"};
    std::string type;
    std::string word;
    const auto end_word = [&] {
        if (std::ranges::find(qualifiers, word) == qualifiers.end())
            type += word;
        word.clear();
    };
    for (const char c : reported.substr(0, reported.find('\0'))) {
        if (c == ' ' || c == '*')
            end_word();
        if (c == '*')
            type += c;
        else if (c != ' ')
            word += c;
    }
    end_word();
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

void check(const Device& device, const char* what, cl_int code) {
    if (code == CL_SUCCESS)
        return;
    clFinish(device.queue()); // as `ask` does
    throw Error(text(device.info().name, " refused ", what, ": OpenCL returned ", in_words(code)));
}

// Drivers differ in what they do with an event that has failed: PoCL waits for ever.
void check_event(const Device& device, cl_event event) {
    require(event != nullptr, "Launch::wait holds a null event");
    cl_context context = nullptr;
    cl_int status = CL_COMPLETE;
    check(device, "an event to wait for", clGetEventInfo(event, CL_EVENT_CONTEXT, sizeof(context), &context, nullptr));
    require(context == device.context(), "Launch::wait holds an event of another context than ", device.info().name,
            "'s");
    check(device, "an event to wait for",
          clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof(status), &status, nullptr));
    if (status < 0)
        throw Error(text("Launch::wait holds an event that has failed: its status is ", status));
}

} // namespace

Launched::Launched(const Device& device, const Launch& launch)
    : device_(device), event_(launch.event), exceptions_(std::uncaught_exceptions()) {
    check_thread();
    const cl_command_queue own = device.queue();
    require(!launch.queue || launch.queue == own,
            "Launch::queue is not the queue of the images' device; leave it null, or make a Device of that queue");
    for (const cl_event event : launch.wait)
        check_event(device, event);
    if (!launch.wait.empty())
        check(device, "the events to wait for",
              clEnqueueBarrierWithWaitList(own, static_cast<cl_uint>(launch.wait.size()), launch.wait.data(), nullptr));
}

void Launched::done() const {
    if (event_)
        check(device_, "an event", clEnqueueMarkerWithWaitList(device_.queue(), 0, nullptr, event_));
}

Launched::~Launched() {
    if (std::uncaught_exceptions() > exceptions_)
        clFinish(device_.queue()); // its error code is dropped: an exception is already on its way
}

} // namespace fathom::runtime
