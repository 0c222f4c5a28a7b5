// Devices: explicit enumeration (no driver's idea of a default), selection by kind, index or name.

#include "require.hpp"
#include "runtime/pocl.hpp"
#include "runtime/state.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <utility>

#include <sys/mman.h>

namespace fathom {
namespace {

struct Found {
    cl::Device device;
    DeviceInfo info;
};

std::string trimmed(std::string value) {
    value.erase(std::find(value.begin(), value.end(), '\0'), value.end());
    const auto blank = [](unsigned char c) { return std::isspace(c) != 0; };
    value.erase(value.begin(), std::find_if_not(value.begin(), value.end(), blank));
    value.erase(std::find_if_not(value.rbegin(), value.rend(), blank).base(), value.end());
    return value;
}

DeviceInfo describe(const cl::Device& device, const cl::Platform& platform, int index) {
    const auto floats = device.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>();
    return {index,
            trimmed(device.getInfo<CL_DEVICE_NAME>()),
            trimmed(platform.getInfo<CL_PLATFORM_NAME>()),
            trimmed(device.getInfo<CL_DEVICE_VERSION>()),
            (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) != 0,
            device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0,
            static_cast<int>(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>()),
            device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>(),
            (floats & CL_FP_DENORM) != 0,
            (floats & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0,
            (floats & CL_FP_FMA) != 0,
            static_cast<int>(device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>())};
}

constexpr cl_int no_platform = -1001; // CL_PLATFORM_NOT_FOUND_KHR: the loader's way to say that no driver is installed

/// What a driver did not do, and whether that was for want of memory.
struct Failure {
    std::string words;
    bool no_room = false;
};

std::vector<Found> find_devices(Failure* failure = nullptr) {
    runtime::check_thread();
    const runtime::PoclFolder folder;
    // What a driver says, or nothing if it fails: one bad driver hides only its own devices.
    const auto or_nothing = [&](const auto& action) -> decltype(action()) {
        try {
            return action();
        } catch (const cl::Error& error) {
            if (failure && error.err() != no_platform && error.err() != CL_DEVICE_NOT_FOUND)
                *failure = {text(error.what(), " returned ", runtime::in_words(error.err())),
                            error.err() == CL_OUT_OF_HOST_MEMORY || error.err() == CL_OUT_OF_RESOURCES};
            return {};
        }
    };
    const auto platforms = or_nothing([] {
        std::vector<cl::Platform> all;
        cl::Platform::get(&all);
        return all;
    });
    std::vector<Found> found;
    for (const cl::Platform& platform : platforms) {
        const auto devices = or_nothing([&] {
            std::vector<cl::Device> all;
            platform.getDevices(CL_DEVICE_TYPE_ALL, &all);
            return all;
        });
        for (const cl::Device& device : devices) {
            const auto info =
                or_nothing([&] { return std::optional(describe(device, platform, static_cast<int>(found.size()))); });
            if (info)
                found.push_back({device, *info});
        }
    }
    return found;
}

std::string lower(std::string value) {
    std::ranges::transform(value, value.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return value;
}

bool answers_to(const DeviceInfo& info, const std::string& wanted) {
    if (wanted == "cpu")
        return info.cpu;
    if (wanted == "gpu")
        return !info.cpu;
    int index = -1;
    const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
    if (error == std::errc{} && end == wanted.data() + wanted.size())
        return info.index == index;
    return lower(info.name).find(wanted) != std::string::npos;
}

/// Is there memory for a driver to be loaded into? PoCL's compiler alone takes 200 MiB.
bool has_memory_for_driver() {
    constexpr std::size_t driver = std::size_t{256} << 20;
    void* const place = mmap(nullptr, driver, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    return place != MAP_FAILED && munmap(place, driver) == 0;
}

// What lacks room is there, and no other device would do better.
[[noreturn]] void refuse_without_devices(const Failure& failure) {
    if (failure.no_room)
        throw Error("an OpenCL driver has no room: " + failure.words);
    if (!failure.words.empty())
        throw NoDevice("no OpenCL device answers: " + failure.words);
    const runtime::PoclRefusal refusal = runtime::pocl_refusal();
    if (refusal.full)
        throw Error("PoCL, if it is installed, keeps what it compiles in " + refusal.words);
    if (!refusal.words.empty())
        throw NoDevice("no OpenCL device answers; if PoCL is installed, it keeps what it compiles in " + refusal.words);
    if (!has_memory_for_driver())
        throw Error(
            "less than 256 MiB of memory are left, into which no OpenCL driver can be loaded; raise the limit of "
            "this process (ulimit -v)");
    if (const char* const vendors = std::getenv("OCL_ICD_VENDORS"); vendors && *vendors)
        throw NoDevice(text("no OpenCL device is found in ", vendors,
                            ", the only place where OCL_ICD_VENDORS has drivers looked for; unset it, or let it name "
                            "a driver's library or a folder of .icd files"));
    throw NoDevice("no OpenCL device is installed; a CPU becomes one with the package pocl-opencl-icd, "
                   "which needs a folder to write into (POCL_CACHE_DIR)");
}

const Found& choose(const std::vector<Found>& found, const std::string& wanted, const Failure& failure) {
    if (found.empty())
        refuse_without_devices(failure);
    if (wanted.empty()) {
        const auto gpu = std::ranges::find_if(found, [](const Found& f) { return !f.info.cpu; });
        return gpu != found.end() ? *gpu : found.front();
    }
    const auto match = std::ranges::find_if(found, [&](const Found& f) { return answers_to(f.info, lower(wanted)); });
    if (match != found.end())
        return *match;
    std::string names;
    for (const Found& f : found)
        names += text(names.empty() ? "" : ", ", f.info.index, " ", f.info.name);
    throw NoDevice(text("no OpenCL device answers to \"", wanted, "\"; there is: ", names));
}

/// Has this processor AVX but not AVX2? Its native vectors are as wide, and ssao takes 0.52 of the time with 4 pixels.
bool has_avx_alone() {
#if defined(__x86_64__) || defined(__i386__)
    return __builtin_cpu_supports("avx") && !__builtin_cpu_supports("avx2");
#else
    return false;
#endif
}

DeviceOptions completed(DeviceOptions options, const DeviceInfo& info) {
    // The native width, but 16 where that is 8: dof takes 0.69 of the time there. At 4, ssao takes 0.61 of what it takes at 16.
    if (options.vector_width == 0)
        options.vector_width = !info.cpu || info.native_vector_width < 4         ? 1
                               : info.native_vector_width < 8 || has_avx_alone() ? 4
                                                                                 : 16;
    if (options.group_size == 0)
        options.group_size = 64;
    if (options.arithmetic == Arithmetic::automatic)
        options.arithmetic = info.fp64 ? Arithmetic::fp64 : Arithmetic::two_float;
    require(options.vector_width == 1 || options.vector_width == 4 || options.vector_width == 8 ||
                options.vector_width == 16,
            "vector_width = ", options.vector_width, " must be 1, 4, 8 or 16");
    require(options.group_size >= 1 && options.group_size <= 1024, "group_size = ", options.group_size,
            " must be 1 to 1024");
    require(options.arithmetic != Arithmetic::fp64 || info.fp64, "arithmetic = fp64: ", info.name,
            " has no double; use two_float");
    return options;
}

// Drivers that were seen to compile Clang's builtins right. Others are not tried: one ends the process.
bool compiles_builtins(const DeviceInfo& info) {
    constexpr std::string_view platforms[] = {"Portable Computing Language", "Intel(R) OpenCL"};
    return info.cpu && std::ranges::find(platforms, info.platform) != std::end(platforms);
}

std::shared_ptr<Device::State> make_state(std::shared_ptr<runtime::Context> shared, const DeviceInfo& info,
                                          const DeviceOptions& options, const cl::CommandQueue& queue) {
    std::shared_ptr<Device::State> state(new Device::State, [](Device::State* gone) { runtime::release(gone); });
    state->shared = std::move(shared);
    state->info = info;
    state->clang_builtins = compiles_builtins(info);
    state->options = completed(options, info);
    state->queue = queue;
    state->in_order = (queue.getInfo<CL_QUEUE_PROPERTIES>() & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE) == 0;
    return state;
}

} // namespace

std::vector<DeviceInfo> list_devices() {
    std::vector<DeviceInfo> infos;
    for (const Found& found : find_devices())
        infos.push_back(found.info);
    return infos;
}

Device Device::open(const std::string& wanted, const DeviceOptions& options) {
    Failure failure;
    const std::vector<Found> all = find_devices(&failure);
    const Found& found = choose(all, wanted, failure);
    Device device;
    const auto make = [&] {
        const auto shared = runtime::own_context(found.device);
        device.state_ = make_state(shared, found.info, options, cl::CommandQueue(shared->context, found.device));
    };
    runtime::ask_driver(make, found.info.name, " cannot be opened");
    return device;
}

Device::Device(cl_context context, cl_device_id device, cl_command_queue queue, const DeviceOptions& options) {
    require(context && device && queue, "a Device needs a context, a device and a queue, and one of them is null");
    const auto join = [&] {
        const cl::Context of_context(context, true);
        const cl::Device of_device(device, true);
        const cl::CommandQueue of_queue(queue, true);
        require(of_queue.getInfo<CL_QUEUE_CONTEXT>() == of_context, "the queue is of another context");
        require(of_queue.getInfo<CL_QUEUE_DEVICE>() == of_device, "the queue is of another device");
        const cl::Platform platform(of_device.getInfo<CL_DEVICE_PLATFORM>());
        state_ = make_state(runtime::context_for(of_context, of_device), describe(of_device, platform, -1), options,
                            of_queue);
    };
    runtime::ask_driver(join, "the device cannot be used");
}

Device::State& Device::state() const {
    require(state_ != nullptr, "this Device is none yet: open one with Device::open");
    return *state_;
}

const DeviceInfo& Device::info() const {
    return state().info;
}
const DeviceOptions& Device::options() const {
    return state().options;
}
cl_context Device::context() const {
    return state().shared->context();
}
cl_device_id Device::id() const {
    return state().shared->device();
}
cl_command_queue Device::queue() const {
    return state().queue();
}

void Device::finish() const {
    runtime::ask(
        *this, [&] { state().queue.finish(); }, "failed");
}

} // namespace fathom
