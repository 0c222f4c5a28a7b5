// Devices: explicit enumeration (no driver's idea of a default), selection by kind, index or name.

#include <fathom/device.hpp>

#include "require.hpp"
#include "runtime/state.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

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
    return {index,
            trimmed(device.getInfo<CL_DEVICE_NAME>()),
            trimmed(platform.getInfo<CL_PLATFORM_NAME>()),
            trimmed(device.getInfo<CL_DEVICE_VERSION>()),
            (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) != 0,
            device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0,
            static_cast<int>(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>()),
            device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>()};
}

std::vector<Found> find_devices() {
    std::vector<cl::Platform> platforms;
    try {
        cl::Platform::get(&platforms);
    } catch (const cl::Error&) {
        return {}; // the loader's way to say that no driver is installed
    }
    std::vector<Found> found;
    for (const cl::Platform& platform : platforms) {
        std::vector<cl::Device> devices;
        try {
            platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
        } catch (const cl::Error&) {
            continue; // a driver without a device
        }
        for (const cl::Device& device : devices) {
            found.push_back({device, describe(device, platform, static_cast<int>(found.size()))});
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

const Found& choose(const std::vector<Found>& found, const std::string& wanted) {
    if (found.empty()) {
        throw NoDevice("no OpenCL device is installed; a CPU becomes one with the package pocl-opencl-icd");
    }
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

DeviceOptions completed(DeviceOptions options, const DeviceInfo& info) {
    if (options.vector_width == 0)
        options.vector_width = info.cpu ? 16 : 1;
    if (options.group_size == 0)
        options.group_size = 64;
    if (options.arithmetic == Arithmetic::automatic) {
        options.arithmetic = info.fp64 ? Arithmetic::fp64 : Arithmetic::two_float;
    }
    if (options.vector_width != 1 && options.vector_width != 4 && options.vector_width != 8 &&
        options.vector_width != 16) {
        throw std::invalid_argument(text("vector_width = ", options.vector_width, " must be 1, 4, 8 or 16"));
    }
    if (options.group_size < 1 || options.group_size > 1024) {
        throw std::invalid_argument(text("group_size = ", options.group_size, " must be 1 to 1024"));
    }
    if (options.arithmetic == Arithmetic::fp64 && !info.fp64) {
        throw std::invalid_argument(text("arithmetic = fp64: ", info.name, " has no double; use two_float"));
    }
    return options;
}

} // namespace

std::vector<DeviceInfo> list_devices() {
    std::vector<DeviceInfo> infos;
    for (const Found& found : find_devices())
        infos.push_back(found.info);
    return infos;
}

Device Device::open(const std::string& wanted, const DeviceOptions& options) {
    const std::vector<Found> all = find_devices();
    const Found& found = choose(all, wanted);
    try {
        const cl::Context context(found.device);
        Device device(context(), found.device(), cl::CommandQueue(context, found.device)(), options);
        device.state_->info = found.info;
        return device;
    } catch (const cl::Error& error) {
        throw NoDevice(text(found.info.name, " cannot be opened: ", error.what(), " returned ", error.err()));
    }
}

Device::Device(cl_context context, cl_device_id device, cl_command_queue queue, const DeviceOptions& options) {
    require(context && device && queue, "a Device needs a context, a device and a queue, none of them null");
    try {
        const cl::Context of_context(context, true);
        const cl::Device of_device(device, true);
        const cl::CommandQueue of_queue(queue, true);
        require(of_queue.getInfo<CL_QUEUE_CONTEXT>()() == context, "the queue is of another context");
        require(of_queue.getInfo<CL_QUEUE_DEVICE>()() == device, "the queue is of another device");
        require((of_queue.getInfo<CL_QUEUE_PROPERTIES>() & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE) == 0,
                "the queue is out of order; an in-order queue is needed");
        const DeviceInfo info = describe(of_device, cl::Platform(of_device.getInfo<CL_DEVICE_PLATFORM>()), 0);
        state_ =
            std::make_shared<State>(State{info, completed(options, info), of_device, of_context, of_queue, {}, {}});
    } catch (const cl::Error& error) {
        throw Error(text("the device cannot be used: ", error.what(), " returned ", error.err()));
    }
}

const DeviceInfo& Device::info() const {
    return state_->info;
}
const DeviceOptions& Device::options() const {
    return state_->options;
}
cl_context Device::context() const {
    return state_->context();
}
cl_device_id Device::id() const {
    return state_->device();
}
cl_command_queue Device::queue() const {
    return state_->queue();
}

void Device::finish() const {
    try {
        state_->queue.finish();
    } catch (const cl::Error& error) {
        throw Error(text(state_->info.name, " failed: ", error.what(), " returned ", error.err()));
    }
}

} // namespace fathom
