// The layer: one hook for each function that the library calls or might call, made by a template from the function's type.

#define CL_TARGET_OPENCL_VERSION 300
#define CL_USE_DEPRECATED_OPENCL_1_1_APIS
#define CL_USE_DEPRECATED_OPENCL_1_2_APIS
#include "layer.hpp"

#include <CL/cl.h>
#include <CL/cl_layer.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <tuple>
#include <type_traits>
#include <utility>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/asan_interface.h>
#endif

namespace {

/// What a hook does besides counting.
enum class Does {
    tells,    // an information
    makes,    // an object, which the program then holds
    retains,  // one more reference
    releases, // one reference less
    sets,     // something of an object
    starts,   // a command in a queue, and perhaps an event
    orders,   // the same, and its event comes after everything before it in any queue
    waits,    // for the device
};

/// Function, what it does, the error that it fails with (0: it never fails).
#define FATHOM_LAYER_CALLS(X)                                                                                          \
    X(clGetPlatformIDs, tells, CL_OUT_OF_HOST_MEMORY)                                                                  \
    X(clGetPlatformInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                                 \
    X(clGetDeviceIDs, tells, CL_OUT_OF_RESOURCES)                                                                      \
    X(clGetDeviceInfo, tells, CL_OUT_OF_RESOURCES)                                                                     \
    X(clCreateContext, makes, CL_DEVICE_NOT_AVAILABLE)                                                                 \
    X(clCreateContextFromType, makes, CL_DEVICE_NOT_AVAILABLE)                                                         \
    X(clRetainContext, retains, 0)                                                                                     \
    X(clReleaseContext, releases, 0)                                                                                   \
    X(clGetContextInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                                  \
    X(clCreateCommandQueue, makes, CL_OUT_OF_RESOURCES)                                                                \
    X(clCreateCommandQueueWithProperties, makes, CL_OUT_OF_RESOURCES)                                                  \
    X(clRetainCommandQueue, retains, 0)                                                                                \
    X(clReleaseCommandQueue, releases, 0)                                                                              \
    X(clGetCommandQueueInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                             \
    X(clCreateBuffer, makes, CL_MEM_OBJECT_ALLOCATION_FAILURE)                                                         \
    X(clCreateSubBuffer, makes, CL_MEM_OBJECT_ALLOCATION_FAILURE)                                                      \
    X(clRetainMemObject, retains, 0)                                                                                   \
    X(clReleaseMemObject, releases, 0)                                                                                 \
    X(clGetMemObjectInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                                \
    X(clSetMemObjectDestructorCallback, sets, CL_OUT_OF_HOST_MEMORY)                                                   \
    X(clCreateProgramWithSource, makes, CL_OUT_OF_HOST_MEMORY)                                                         \
    X(clCreateProgramWithBinary, makes, CL_OUT_OF_HOST_MEMORY)                                                         \
    X(clRetainProgram, retains, 0)                                                                                     \
    X(clReleaseProgram, releases, 0)                                                                                   \
    X(clBuildProgram, sets, CL_BUILD_PROGRAM_FAILURE)                                                                  \
    X(clCompileProgram, sets, CL_COMPILE_PROGRAM_FAILURE)                                                              \
    X(clLinkProgram, makes, CL_LINK_PROGRAM_FAILURE)                                                                   \
    X(clGetProgramInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                                  \
    X(clGetProgramBuildInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                             \
    X(clCreateKernel, makes, CL_OUT_OF_HOST_MEMORY)                                                                    \
    X(clCloneKernel, makes, CL_OUT_OF_HOST_MEMORY)                                                                     \
    X(clRetainKernel, retains, 0)                                                                                      \
    X(clReleaseKernel, releases, 0)                                                                                    \
    X(clSetKernelArg, sets, CL_OUT_OF_RESOURCES)                                                                       \
    X(clGetKernelInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                                   \
    X(clGetKernelArgInfo, tells, CL_KERNEL_ARG_INFO_NOT_AVAILABLE)                                                     \
    X(clGetKernelWorkGroupInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                          \
    X(clCreateUserEvent, makes, CL_OUT_OF_HOST_MEMORY)                                                                 \
    X(clSetUserEventStatus, sets, CL_OUT_OF_HOST_MEMORY)                                                               \
    X(clSetEventCallback, sets, CL_OUT_OF_HOST_MEMORY)                                                                 \
    X(clRetainEvent, retains, 0)                                                                                       \
    X(clReleaseEvent, releases, 0)                                                                                     \
    X(clGetEventInfo, tells, CL_OUT_OF_HOST_MEMORY)                                                                    \
    X(clGetEventProfilingInfo, tells, CL_PROFILING_INFO_NOT_AVAILABLE)                                                 \
    X(clFlush, sets, CL_OUT_OF_RESOURCES)                                                                              \
    X(clFinish, waits, CL_OUT_OF_RESOURCES)                                                                            \
    X(clWaitForEvents, waits, CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST)                                            \
    X(clEnqueueReadBuffer, starts, CL_OUT_OF_RESOURCES)                                                                \
    X(clEnqueueReadBufferRect, starts, CL_OUT_OF_RESOURCES)                                                            \
    X(clEnqueueWriteBuffer, starts, CL_OUT_OF_RESOURCES)                                                               \
    X(clEnqueueWriteBufferRect, starts, CL_OUT_OF_RESOURCES)                                                           \
    X(clEnqueueFillBuffer, starts, CL_OUT_OF_RESOURCES)                                                                \
    X(clEnqueueCopyBuffer, starts, CL_MEM_COPY_OVERLAP)                                                                \
    X(clEnqueueCopyBufferRect, starts, CL_MEM_COPY_OVERLAP)                                                            \
    X(clEnqueueMapBuffer, starts, CL_MAP_FAILURE)                                                                      \
    X(clEnqueueUnmapMemObject, starts, CL_OUT_OF_RESOURCES)                                                            \
    X(clEnqueueMigrateMemObjects, starts, CL_MEM_OBJECT_ALLOCATION_FAILURE)                                            \
    X(clEnqueueNDRangeKernel, starts, CL_MEM_OBJECT_ALLOCATION_FAILURE)                                                \
    X(clEnqueueTask, starts, CL_MEM_OBJECT_ALLOCATION_FAILURE)                                                         \
    X(clEnqueueMarkerWithWaitList, orders, CL_OUT_OF_HOST_MEMORY)                                                      \
    X(clEnqueueBarrierWithWaitList, orders, CL_OUT_OF_HOST_MEMORY)

enum class Call {
#define X(function, does, code) function,
    FATHOM_LAYER_CALLS(X)
#undef X
};

struct Function {
    const char* name;
    Does does;
    cl_int code;
};

constexpr std::array functions{
#define X(function, does, code) Function{#function, Does::does, code},
    FATHOM_LAYER_CALLS(X)
#undef X
};

constexpr Function about(Call call) {
    return functions[static_cast<std::size_t>(call)];
}

struct Memory {
    const char* begin;
    std::size_t size;
};

/// One command queue's commands, in the order in which they were started.
struct Commands {
    bool in_order = true;
    int started = 0, finished = 0;
    std::vector<Memory> used; // by what is not finished
};

/// An event stands for the commands of a queue up to this one.
struct Reached {
    cl_command_queue queue;
    int commands;
};

struct Held {
    const char* made_by;
    int references;
};

/// A program's context, source and options.
using Build = std::tuple<cl_context, std::string, std::string>;

struct Account {
    std::mutex mutex;
    std::map<cl_program, Build> programs;     // that the program holds
    std::map<Build, cl_program> built;        // that this layer holds
    std::map<cl_program, cl_program> instead; // of one that the program holds: the one that was built
    std::array<int, functions.size()> calls{};
    std::vector<Call> points;
    std::size_t fails_at = ~std::size_t{0};
    layer::Failure failure = layer::Failure::once;
    cl_int code = CL_SUCCESS; // instead of the function's own
    std::ofstream list;       // of the points
    int host_waits = 0;
    std::map<const void*, Held> held;
    std::map<cl_command_queue, Commands> queues;
    std::map<cl_event, Reached> events;
    std::map<cl_mem, Memory> host_memory; // of buffers that are the host's memory
    std::map<const void*, std::size_t> claimed;
    std::map<cl_kernel, std::map<cl_uint, Memory>> arguments;
    std::string freed_too_early;
};

// Lives as long as the process: drivers release things late.
Account& account() {
    static Account& kept = *new Account;
    return kept;
}

cl_icd_dispatch target{}, hooked{};
std::atomic<bool> initialised = false;

/// Counts a call. Must it fail?
bool counted(Call call) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    ++all.calls[static_cast<std::size_t>(call)];
    if (about(call).code == 0)
        return false;
    const std::size_t point = all.points.size();
    all.points.push_back(call);
    if (all.list.is_open())
        all.list << about(call).name << std::endl; // the process may be killed
    return point == all.fails_at || (point > all.fails_at && all.failure == layer::Failure::from_here);
}

void hold(const void* object, const char* made_by) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    ++all.held.try_emplace(object, Held{made_by, 0}).first->second.references;
}

void let_go(const void* object) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    const auto found = all.held.find(object);
    if (found != all.held.end() && --found->second.references == 0) {
        all.held.erase(found);
        all.programs.erase(static_cast<cl_program>(const_cast<void*>(object)));
        all.instead.erase(static_cast<cl_program>(const_cast<void*>(object)));
        all.queues.erase(static_cast<cl_command_queue>(const_cast<void*>(object)));
        all.host_memory.erase(static_cast<cl_mem>(const_cast<void*>(object)));
        all.claimed.erase(object);
        all.arguments.erase(static_cast<cl_kernel>(const_cast<void*>(object)));
        all.events.erase(static_cast<cl_event>(const_cast<void*>(object)));
    }
}

/// What commands used is looked at when they are waited for: they may not have run before.
void check_memory(Account& all, const Commands& commands) {
#ifdef __SANITIZE_ADDRESS__
    for (const Memory& memory : commands.used)
        if (__asan_region_is_poisoned(const_cast<char*>(memory.begin), memory.size))
            all.freed_too_early = "memory of " + std::to_string(memory.size) + " bytes was freed before a wait";
#else
    static_cast<void>(all);
    static_cast<void>(commands);
#endif
}

void finished(cl_command_queue queue, int commands) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    Commands& of = all.queues[queue];
    of.finished = std::max(of.finished, commands);
    if (of.finished == of.started)
        of.used.clear();
}

int started(cl_command_queue queue) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    return all.queues[queue].started;
}

bool in_order(cl_command_queue queue) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    return all.queues[queue].in_order;
}

/// Before a wait of the host.
void waiting(cl_command_queue queue) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    ++all.host_waits;
    check_memory(all, all.queues[queue]);
}

/// A command was started; `everything`: its event comes after all before it.
void start(cl_command_queue queue, cl_event event, bool everything) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    Commands& commands = all.queues[queue];
    ++commands.started;
    if (event) {
        all.held[event] = {"event", 1};
        if (everything || commands.in_order)
            all.events[event] = {queue, commands.started};
    }
}

void use(cl_command_queue queue, cl_kernel kernel) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    for (const auto& [index, memory] : all.arguments[kernel])
        all.queues[queue].used.push_back(memory);
}

void set_argument(cl_kernel kernel, cl_uint index, std::size_t size, const void* value) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    cl_mem buffer = nullptr;
    if (size == sizeof(buffer) && value)
        std::memcpy(&buffer, value, size);
    if (const auto found = all.host_memory.find(buffer); found != all.host_memory.end())
        all.arguments[kernel][index] = found->second;
    else
        all.arguments[kernel].erase(index);
}

void tell_claim(cl_mem buffer, cl_mem_info what, void* value) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    if (const auto found = all.claimed.find(buffer); what == CL_MEM_SIZE && value && found != all.claimed.end())
        std::memcpy(value, &found->second, sizeof found->second);
}

void made_buffer(cl_mem buffer, const Memory& memory) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    all.host_memory[buffer] = memory;
}

void made_sub_buffer(cl_mem buffer, cl_mem parent, const cl_buffer_region& region) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    if (const auto found = all.host_memory.find(parent); found != all.host_memory.end())
        all.host_memory[buffer] = {found->second.begin + region.origin, region.size};
}

void made_queue(cl_command_queue queue) {
    cl_command_queue_properties properties = 0;
    target.clGetCommandQueueInfo(queue, CL_QUEUE_PROPERTIES, sizeof(properties), &properties, nullptr);
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    all.queues[queue] = {.in_order = (properties & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE) == 0, .used = {}};
}

void made_program(cl_program program, cl_context context, cl_uint count, const char** texts, const size_t* lengths) {
    std::string source;
    for (cl_uint i = 0; i < count; ++i)
        source += lengths && lengths[i] > 0 ? std::string(texts[i], lengths[i]) : std::string(texts[i]);
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    all.programs[program] = {context, std::move(source), {}};
}

/// Was the same built before? Its kernels are made of that program then.
bool built_before(cl_program program, const char* options) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    Build& build = all.programs[program];
    std::get<2>(build) = options ? options : "";
    const auto found = all.built.find(build);
    if (found == all.built.end())
        return false;
    all.instead[program] = found->second;
    return true;
}

void built(cl_program program) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    if (!all.instead.contains(program) && all.built.try_emplace(all.programs[program], program).second)
        target.clRetainProgram(program);
}

cl_program built_instead(cl_program program) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    const auto found = all.instead.find(program);
    return found == all.instead.end() ? program : found->second;
}

Reached reached(cl_event event) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    const auto found = all.events.find(event);
    return found == all.events.end() ? Reached{nullptr, 0} : found->second;
}

/// What a call that must fail returns.
cl_int code_of(Call call) {
    const cl_int given = account().code;
    return given == CL_SUCCESS ? about(call).code : given;
}

/// Crashes as a compiler does over such options, where the environment asks for it: in a program's build, or as PoCL also does when a
/// kernel is started.
void crash_over(const char* options, std::string_view when) {
    static const char *const over = std::getenv("FATHOM_LAYER_CRASHES"), *const at =
                                                                             std::getenv("FATHOM_LAYER_CRASHES_AT");
    if (!over || !options || (at ? at : "build") != when || !std::strstr(options, over))
        return;
    std::fputs("LLVM ERROR: of a test\n", stderr);
    std::abort();
}

void crash_over(cl_kernel kernel) {
    static const bool asked = std::getenv("FATHOM_LAYER_CRASHES_AT");
    if (!asked)
        return;
    cl_program program = nullptr;
    std::size_t count = 0, size = 0;
    target.clGetKernelInfo(kernel, CL_KERNEL_PROGRAM, sizeof program, static_cast<void*>(&program), nullptr);
    target.clGetProgramInfo(program, CL_PROGRAM_DEVICES, 0, nullptr, &count);
    std::vector<cl_device_id> devices(count / sizeof(cl_device_id));
    target.clGetProgramInfo(program, CL_PROGRAM_DEVICES, count, static_cast<void*>(devices.data()), nullptr);
    target.clGetProgramBuildInfo(program, devices.front(), CL_PROGRAM_BUILD_OPTIONS, 0, nullptr, &size);
    std::string options(size, '\0');
    target.clGetProgramBuildInfo(program, devices.front(), CL_PROGRAM_BUILD_OPTIONS, size, options.data(), nullptr);
    crash_over(options.c_str(), "start");
}

/// What the environment asks for: the program of a test has no other way to say it.
void read_environment() {
    if (const char* const list = std::getenv("FATHOM_LAYER_POINTS"))
        account().list.open(list);
    if (const char* const fails = std::getenv("FATHOM_LAYER_FAILS")) {
        std::istringstream words(fails); // as in "12 -5 once", or always
        std::string how_often;
        std::size_t point = 0;
        words >> point >> account().code >> how_often;
        layer::fail(point, how_often == "always" ? layer::Failure::from_here : layer::Failure::once);
    }
}

template <Call call, typename Object, typename Arguments>
void made(Object object, const Arguments& arguments) {
    if constexpr (call == Call::clCreateBuffer) {
        const auto& [context, flags, size, host, error] = arguments;
        if (host && (flags & CL_MEM_USE_HOST_PTR) != 0)
            made_buffer(object, {static_cast<const char*>(host), size});
    } else if constexpr (call == Call::clCreateSubBuffer) {
        made_sub_buffer(object, std::get<0>(arguments), *static_cast<const cl_buffer_region*>(std::get<3>(arguments)));
    } else if constexpr (call == Call::clCreateProgramWithSource) {
        const auto& [context, count, texts, lengths, error] = arguments;
        made_program(object, context, count, texts, lengths);
    } else if constexpr (call == Call::clCreateCommandQueue || call == Call::clCreateCommandQueueWithProperties) {
        made_queue(object);
    }
    hold(object, about(call).name);
}

template <typename Result, typename Arguments>
Result failed(cl_int code, const Arguments& arguments) {
    if constexpr (std::is_pointer_v<Result>) {
        if (cl_int* told = std::get<std::tuple_size_v<Arguments> - 1>(arguments))
            *told = code;
        return nullptr;
    } else {
        return code;
    }
}

/// Does a call that starts a command wait for it?
template <Call call, typename Arguments>
bool blocks(const Arguments& arguments) {
    if constexpr (call == Call::clEnqueueReadBuffer || call == Call::clEnqueueReadBufferRect ||
                  call == Call::clEnqueueWriteBuffer || call == Call::clEnqueueWriteBufferRect ||
                  call == Call::clEnqueueMapBuffer)
        return std::get<2>(arguments) == CL_TRUE;
    else
        return false;
}

/// Does a buffer hold a rectangle's rows in the whole length of their pitch? NVIDIA's driver refuses one whose last row is
/// cut short, though OpenCL permits that.
bool holds_rows(cl_mem buffer, const size_t* origin, const size_t* region, size_t pitch) {
    std::size_t bytes = 0;
    target.clGetMemObjectInfo(buffer, CL_MEM_SIZE, sizeof bytes, &bytes, nullptr);
    return (origin[1] + region[1]) * std::max(pitch, region[0]) <= bytes;
}

template <Call call, typename Arguments>
bool nvidia_takes(const Arguments& arguments) {
    if constexpr (call == Call::clEnqueueReadBufferRect || call == Call::clEnqueueWriteBufferRect) {
        return holds_rows(std::get<1>(arguments), std::get<3>(arguments), std::get<5>(arguments),
                          std::get<6>(arguments));
    } else if constexpr (call == Call::clEnqueueCopyBufferRect) {
        return holds_rows(std::get<1>(arguments), std::get<3>(arguments), std::get<5>(arguments),
                          std::get<6>(arguments)) &&
               holds_rows(std::get<2>(arguments), std::get<4>(arguments), std::get<5>(arguments),
                          std::get<8>(arguments));
    } else {
        return true;
    }
}

template <Call call, auto function, typename Type>
struct Hook;

template <Call call, auto function, typename Result, typename... Arguments>
struct Hook<call, function, Result(CL_API_CALL*)(Arguments...)> {
    using Tuple = std::tuple<Arguments...>;
    static constexpr Does does = about(call).does;
    static constexpr bool enqueues = does == Does::starts || does == Does::orders;

    static Result CL_API_CALL run(Arguments... arguments) {
        Tuple given(arguments...);
        const bool fails = counted(call);
        if constexpr (does == Does::waits) {
            const Result result = wait(given);
            return fails ? code_of(call) : result;
        } else if constexpr (enqueues) {
            return fails ? failed<Result>(code_of(call), given) : enqueue(given);
        } else {
            if (fails)
                return failed<Result>(code_of(call), given);
            const Result result = pass_on(given);
            after(result, given);
            return result;
        }
    }

    static Result pass_on(Tuple& given) {
        if constexpr (call == Call::clBuildProgram)
            crash_over(std::get<3>(given), "build");
        if constexpr (call == Call::clBuildProgram)
            if (built_before(std::get<0>(given), std::get<3>(given)))
                return CL_SUCCESS;
        if constexpr (call == Call::clCreateKernel || call == Call::clGetProgramInfo ||
                      call == Call::clGetProgramBuildInfo)
            std::get<0>(given) = built_instead(std::get<0>(given));
        return std::apply([](auto... all) { return (target.*function)(all...); }, given);
    }

    static void after(Result result, const Tuple& given) {
        if constexpr (does == Does::makes) {
            if (result)
                made<call>(result, given);
        } else if (result == CL_SUCCESS) {
            if constexpr (does == Does::retains)
                hold(std::get<0>(given), "object");
            if constexpr (does == Does::releases)
                let_go(std::get<0>(given));
            if constexpr (call == Call::clBuildProgram)
                built(std::get<0>(given));
            if constexpr (call == Call::clGetMemObjectInfo)
                tell_claim(std::get<0>(given), std::get<1>(given), std::get<3>(given));
            if constexpr (call == Call::clSetKernelArg)
                set_argument(std::get<0>(given), std::get<1>(given), std::get<2>(given), std::get<3>(given));
        }
    }

    static Result wait(const Tuple& given) {
        if constexpr (call == Call::clFinish) {
            const cl_command_queue queue = std::get<0>(given);
            const int commands = started(queue);
            waiting(queue);
            const Result result = target.clFinish(queue);
            finished(queue, commands);
            return result;
        } else {
            const auto [count, events] = given;
            std::vector<Reached> all;
            for (cl_uint i = 0; i < count; ++i)
                all.push_back(reached(events[i]));
            waiting(all.empty() ? nullptr : all.front().queue);
            const Result result = target.clWaitForEvents(count, events);
            for (const Reached& each : all)
                if (each.queue)
                    finished(each.queue, each.commands);
            return result;
        }
    }

    static Result enqueue(Tuple& given) {
        if (!nvidia_takes<call>(given))
            return failed<Result>(CL_INVALID_VALUE, given);
        if constexpr (call == Call::clEnqueueNDRangeKernel)
            crash_over(std::get<1>(given));
        const cl_command_queue queue = std::get<0>(given);
        const bool waits = blocks<call>(given);
        if (waits)
            waiting(queue);
        const Result result = std::apply([](auto... all) { return (target.*function)(all...); }, given);
        constexpr std::size_t event = std::tuple_size_v<Tuple> - (std::is_pointer_v<Result> ? 2 : 1);
        bool good;
        if constexpr (std::is_pointer_v<Result>)
            good = result != nullptr;
        else
            good = result == CL_SUCCESS;
        if (!good)
            return result;
        cl_event* const asked = std::get<event>(given);
        start(queue, asked ? *asked : nullptr, does == Does::orders);
        if constexpr (call == Call::clEnqueueNDRangeKernel)
            use(queue, std::get<1>(given));
        if (waits && in_order(queue))
            finished(queue, started(queue));
        return result;
    }
};

} // namespace

extern "C" CL_API_ENTRY cl_int CL_API_CALL clGetLayerInfo(cl_layer_info name, size_t size, void* value,
                                                          size_t* needed) {
    constexpr cl_layer_api_version version = CL_LAYER_API_VERSION_100;
    constexpr char own_name[] = "Fathom's account of calls";
    const void* const what = name == CL_LAYER_API_VERSION ? static_cast<const void*>(&version) : own_name;
    const std::size_t length = name == CL_LAYER_API_VERSION ? sizeof(version) : sizeof(own_name);
    if (name != CL_LAYER_API_VERSION && name != CL_LAYER_NAME)
        return CL_INVALID_VALUE;
    if (value && size < length)
        return CL_INVALID_VALUE;
    if (value)
        std::memcpy(value, what, length);
    if (needed)
        *needed = length;
    return CL_SUCCESS;
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL clInitLayer(cl_uint entries, const cl_icd_dispatch* below,
                                                       cl_uint* own_entries, const cl_icd_dispatch** own) {
    constexpr auto known = static_cast<cl_uint>(sizeof(cl_icd_dispatch) / sizeof(void*));
    if (!below || !own_entries || !own)
        return CL_INVALID_VALUE;
    std::memcpy(static_cast<void*>(&target), below, sizeof(void*) * std::min(entries, known));
    hooked = target;
#define X(function, does, code)                                                                                        \
    if (target.function)                                                                                               \
        hooked.function = Hook<Call::function, &cl_icd_dispatch::function, decltype(target.function)>::run;
    FATHOM_LAYER_CALLS(X)
#undef X
    *own = &hooked;
    *own_entries = std::min(entries, known);
    initialised = true;
    read_environment();
    return CL_SUCCESS;
}

namespace layer {

bool loaded() {
    return initialised;
}

void fail(std::size_t point, Failure failure) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    all.calls.fill(0);
    all.points.clear();
    all.host_waits = 0;
    all.freed_too_early.clear();
    all.fails_at = point;
    all.failure = failure;
}

void reset() {
    fail(~std::size_t{0}, Failure::once);
}

int calls(std::string_view function) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    const auto found = std::ranges::find(functions, function, &Function::name);
    return found == functions.end() ? -1 : all.calls[static_cast<std::size_t>(found - functions.begin())];
}

int host_waits() {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    return all.host_waits;
}

std::vector<std::string> points() {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    std::vector<std::string> names;
    for (const Call call : all.points)
        names.emplace_back(about(call).name);
    return names;
}

std::string held() {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    std::map<std::string, int> kinds;
    for (const auto& [object, held] : all.held)
        kinds[held.made_by] += held.references;
    std::ostringstream list;
    for (const auto& [kind, references] : kinds)
        list << (list.tellp() > 0 ? ", " : "") << references << ' ' << kind;
    return list.str();
}

void claim(const void* buffer, std::size_t bytes) {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    all.claimed[buffer] = bytes;
}

int unfinished() {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    int commands = 0;
    for (const auto& [queue, each] : all.queues)
        commands += each.started - each.finished;
    return commands;
}

std::string freed_too_early() {
    Account& all = account();
    const std::lock_guard lock(all.mutex);
    return all.freed_too_early;
}

} // namespace layer
