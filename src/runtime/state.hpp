#pragma once

#include "runtime/opencl.hpp"
#include "runtime/program.hpp"
#include "text.hpp"

#include <fathom/error.hpp>
#include <fathom/image.hpp>

#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace fathom {
namespace runtime {

/// Something that kernels read, made from a key.
struct Kept {
    std::string key;
    std::size_t bytes;
    std::shared_ptr<const void> value;
};

/// A context with one of its devices, and what was made for them once: every `Device` of the two shares it.
struct Context {
    cl::Context context;
    cl::Device device;

    std::mutex programs_mutex; // held while a program is built
    std::map<std::string, cl::Program> programs;
    std::mutex kept_mutex;
    std::list<Kept> kept; // runtime/table.hpp: the last used first
};

/// The process's own context of a device, made when it is first asked for and kept until the process ends.
std::shared_ptr<Context> own_context(const cl::Device& device);

/// What belongs to somebody's context: kept as long as a `Device` uses it.
std::shared_ptr<Context> context_for(const cl::Context& context, const cl::Device& device);

/// Does this process come from a fork of one that had used OpenCL? Its driver's threads are not here, and its locks may never open.
bool forked();

/// Throws: Error in such a process, which tells what to do instead. From the first call on, a fork counts.
void check_process();

/// The same, for a thread that goes on to compute. Throws: Error also where it does not round to nearest.
void check_thread();

/// Locks a mutex, unless the thread that holds it may be in the process that this one is a fork of.
/// Throws: Error as `check_process`.
[[nodiscard]] inline std::unique_lock<std::mutex> locked(std::mutex& mutex) {
    check_process();
    return std::unique_lock(mutex);
}

/// Deletes what holds OpenCL's objects; in a forked process it stays, because to release it may wait for ever.
template <typename Value>
void release(Value* value) {
    if (!forked())
        delete value;
}

/// An error of a driver and its cure, to be put behind "returned": "-5 (out of resources); …".
std::string in_words(cl_int code);

/// Asks a driver for something. Its error becomes an Error: the parts of `what`, then "<function> returned <code>".
template <typename Action, typename... What>
decltype(auto) ask_driver(const Action& action, const What&... what) {
    check_process();
    try {
        return action();
    } catch (const cl::Error& error) {
        throw Error(text(what..., ": ", error.what(), " returned ", in_words(error.err())));
    }
}

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
