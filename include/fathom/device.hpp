#pragma once

#include <fathom/error.hpp>
#include <fathom/opencl.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace fathom {
#pragma GCC visibility push(default)

/// What a device says about itself.
struct DeviceInfo {
    int index; ///< position in `list_devices`, what `Device::open("2")` takes; -1 for that of somebody's context
    std::string name;
    std::string platform;
    std::string version;
    bool cpu;
    bool fp64;
    int compute_units;
    std::uint64_t memory_bytes;
    /// What the driver says of floats: CL_FP_DENORM, CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT, CL_FP_FMA. What it does is another
    /// matter: see probe.hpp.
    bool denormals;
    bool correct_rounding; ///< of quotients and square roots; kernels are built to have it
    bool fma;
    int native_vector_width; ///< of floats: what one instruction computes
};

/// Every OpenCL device of every platform, in the order that the platforms give.
std::vector<DeviceInfo> list_devices();

/// How sums that need more than a float are done on the device.
enum class Arithmetic {
    automatic, ///< fp64 where the device has it
    fp64,      ///< double; refused by a device that has none
    two_float, ///< unevaluated sums of two floats, for devices without double
};

/// What can be forced on a device. No result depends on it.
struct DeviceOptions {
    Arithmetic arithmetic = Arithmetic::automatic;
    int vector_width = 0; ///< pixels per work-item: 1, 4, 8 or 16; 0: 1 on a GPU, on a CPU as its native width asks for
    int group_size = 0;   ///< work-items per group, fewer if a kernel does not allow so many; 0: 64

    /// Bytes that an operation may take for itself, beside the images that it is given and those that it returns; 0: what is
    /// fastest. What does not fit is done in bands of rows. Where a band and the rows that it reads need more, the operation
    /// throws an Error that names the budget it needs. Calls that run at the same time may take as much each.
    std::size_t memory_budget = 0;
};

struct Camera;
struct StoredDepth;
enum class Storage;

/// An OpenCL device with a context and a queue. A handle: copies share all three.
///
/// Devices of one context share its programs, which are built once. Images belong to the device that they were made for, and
/// an operation refuses those of another.
/// Threads: any number of threads may use one device, or several, at the same time. Their kernels share the queue.
/// After a fork, a process whose parent had used OpenCL can use no device: everything throws Error and says so.
class Device {
public:
    Device() = default; ///< no device yet

    /// Opens a device: "cpu", "gpu", its index in `list_devices`, or a part of its name.
    /// Empty: a GPU where there is one, the CPU otherwise. Each call makes a queue in the process's context of that device.
    /// Throws: NoDevice, naming what is there; std::invalid_argument for a vector width or a group size that does not exist.
    static Device open(const std::string& wanted = {}, const DeviceOptions& options = {});

    /// Takes part in a program that already has a context and a queue. All three are retained. In a queue that is out of order,
    /// a barrier stands before every kernel, so that it runs after all that was started before.
    /// Throws: std::invalid_argument for a null handle and a queue of another context or device; Error from the driver.
    Device(cl_context context, cl_device_id device, cl_command_queue queue, const DeviceOptions& options = {});

    const DeviceInfo& info() const;
    const DeviceOptions& options() const; ///< with the automatic choices made

    /// Handles, which live as long as the device: retain them to keep them longer.
    cl_context context() const;
    cl_device_id id() const;
    cl_command_queue queue() const;

    /// Builds ahead of time what `call` starts, so that its first run is as fast as its second: runs it once, on depth of the
    /// camera's size and this storage that holds every value in turn.
    ///     device.prepare(camera, Storage::float32, [&](const StoredDepth& stored) { ssao(stored, radius, options); });
    /// Kernels differ with the camera's projection and encoding, the storage, the options, and whether images are large and
    /// aligned: give those of the calls to come.
    /// Throws: what the call throws.
    void prepare(const Camera& camera, Storage storage, const std::function<void(const StoredDepth&)>& call) const;

    /// Waits until everything that was started has ended.
    void finish() const;

    struct State; ///< src/runtime only
    State& state() const;

private:
    std::shared_ptr<State> state_;
};

#pragma GCC visibility pop
} // namespace fathom
