// Contexts of the process: one for each device that is opened, and one for each pair that somebody brings.

#include "runtime/state.hpp"

#include "require.hpp"

#include <atomic>

#ifdef __unix__
#include <pthread.h>
#endif

namespace fathom::runtime {
namespace {

// Never destroyed: the driver's own statics may go first when the process ends.
struct Registry {
    std::mutex mutex;
    std::map<cl_device_id, std::shared_ptr<Context>> own;
    std::map<std::pair<cl_context, cl_device_id>, std::weak_ptr<Context>> all;
};

Registry& registry() {
    static Registry* const only = new Registry;
    return *only;
}

std::atomic<bool> in_child = false;

std::shared_ptr<Context> make(const cl::Context& context, const cl::Device& device) {
    std::shared_ptr<Context> made(new Context, release<Context>);
    made->context = context;
    made->device = device;
    return made;
}

} // namespace

std::shared_ptr<Context> own_context(const cl::Device& device) {
    const auto lock = locked(registry().mutex);
    std::shared_ptr<Context>& own = registry().own[device()];
    if (!own) {
        own = make(cl::Context(device), device);
        registry().all[{own->context(), device()}] = own;
    }
    return own;
}

std::shared_ptr<Context> context_for(const cl::Context& context, const cl::Device& device) {
    const auto lock = locked(registry().mutex);
    std::erase_if(registry().all, [](const auto& each) { return each.second.expired(); });
    std::weak_ptr<Context>& known = registry().all[{context(), device()}];
    std::shared_ptr<Context> found = known.lock();
    if (!found)
        known = found = make(context, device);
    return found;
}

std::string in_words(cl_int code) {
    const auto no_room = [code](const char* what) {
        return text(code, " (", what, "); free memory that others take, or give a smaller image or memory budget");
    };
    switch (code) {
    case CL_DEVICE_NOT_AVAILABLE:
        return text(code, " (the device is not available); check that it is still there, and start again");
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
        return no_room("no memory for a buffer");
    case CL_OUT_OF_RESOURCES:
        return no_room("out of resources");
    case CL_OUT_OF_HOST_MEMORY:
        return no_room("out of host memory");
    default:
        return text(code, "; start again, or try another device or driver");
    }
}

bool forked() {
    return in_child;
}

void check_process() {
#ifdef __unix__
    static const int watched = pthread_atfork(nullptr, nullptr, [] { in_child = true; });
    static_cast<void>(watched);
#endif
    if (forked())
        throw Error(
            "OpenCL was used before this process was forked, and does not work in it: start the process anew instead "
            "(Python: multiprocessing's \"spawn\"), or fork before Fathom is first used");
}

void check_thread() {
    check_process();
    require_rounding();
}

} // namespace fathom::runtime
