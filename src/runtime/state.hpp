#pragma once

#include "runtime/context.hpp"

#include <fathom/image.hpp>

#include <list>
#include <map>
#include <mutex>
#include <string>

namespace fathom {

namespace runtime {

/// Memory for images between the passes of an operation.
struct ScratchBuffer {
    std::size_t size;
    cl::Buffer buffer;
};

} // namespace runtime

/// What the copies of a `Device` share: a queue, and what belongs to one. Kernels carry their arguments until they are started.
struct Device::State {
    std::shared_ptr<runtime::Context> shared;
    DeviceInfo info;
    DeviceOptions options; // with the automatic choices made
    cl::CommandQueue queue;
    bool in_order = true;
    bool clang_builtins = false; // for kernels: prefetch, stores past the cache and shuffles, as Clang spells them

    int crashed_widths = 0; // a bit of its own for each vector width for which a compiler crashed: runtime/compiler.hpp

    std::mutex mutex; // of what follows
    std::map<std::string, runtime::Kernel> kernels;
    std::list<runtime::ScratchBuffer> scratch; // runtime/scratch.hpp
    std::size_t scratch_bytes = 0;             // of these buffers and of those in use
    std::size_t most_scratch_bytes = 0;        // that there were at a time
    std::size_t calls_with_scratch = 0;        // that run now
};

namespace runtime {

inline const cl::CommandQueue& queue_of(const Device& device) {
    return device.state().queue;
}
inline const cl::Context& context_of(const Device& device) {
    return device.state().shared->context;
}
inline cl::Buffer buffer_of(const Image& image) {
    return cl::Buffer(image.buffer(), true);
}

/// Another owner of a buffer.
std::shared_ptr<_cl_mem> shared(cl_mem buffer);

/// What follows in the queue starts after everything before it. A queue that is in order does that by itself.
inline void keep_order(const Device& device) {
    if (!device.state().in_order)
        queue_of(device).enqueueBarrierWithWaitList();
}

/// Asks a device for something: `ask(device, [&] { … }, "refused ", name)`. The driver's error becomes an Error. All that was
/// started has ended by then, by earlier operations, too: the memory of their images may go while the Error passes. So no lock
/// is held here.
template <typename Action, typename... What>
decltype(auto) ask(const Device& device, const Action& action, const What&... what) {
    try {
        return ask_driver(action, device.info().name, ' ', what...);
    } catch (const Error&) {
        if (!forked())
            clFinish(device.queue()); // its own error adds nothing
        throw;
    }
}

} // namespace runtime
} // namespace fathom
