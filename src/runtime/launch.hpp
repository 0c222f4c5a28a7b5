#pragma once

#include "params.h"
#include "runtime/compiler.hpp"
#include "runtime/program.hpp"
#include "runtime/state.hpp"

#include <fathom/image.hpp>
#include <fathom/launch.hpp>

#include <string_view>
#include <type_traits>

namespace fathom::runtime {

/// Work-items in x and y; x is rounded up to whole groups, and the kernel checks its bounds.
struct Range {
    std::size_t x, y;
};

inline std::string argument_type(const Image& image) {
    static constexpr const char* types[] = {"uchar*", "ushort*", "uint*", "ushort*",
                                            "float*"}; // in the order of Element
    return types[static_cast<std::size_t>(image.element())];
}
template <typename Params>
std::string argument_type(const Params& params) {
    return type_name(params); // defined by PARAMS in params.h
}

inline cl::Buffer argument_value(const Image& image) {
    return buffer_of(image);
}
template <typename Params>
const Params& argument_value(const Params& params) {
    return params;
}

/// The bare name of an argument's type. Drivers spell it in several ways: "float*", "__global const float *",
/// "struct grid_params".
std::string bare_type(std::string_view reported);

/// Compares the kernel's own declaration with what it is given, once: PoCL accepts any struct, whatever its name. That a
/// struct has the same size on both sides is what PARAMS in params.h asserts.
void check(Kernel& kernel, const std::vector<std::string>& types);

/// Work-items per group: as many as the device's options say, if the kernel allows so many. Results do not depend on it.
std::size_t group_size(const Device& device, Kernel& kernel);

/// Starts a kernel: images and params in the order of its declaration. Other threads may do the same at the same time.
/// Throws: Error when they are not what the kernel declares, or when the device refuses.
template <typename... Arguments>
void launch(const Device& device, Kernel& kernel, Range range, const Arguments&... arguments) {
    const auto start = [&] {
        const auto lock = locked(device.state().mutex); // from the first argument until the kernel has them all
        const std::size_t group = group_size(device, kernel);
        const std::size_t rounded = (range.x + group - 1) / group * group;
        if (const unsigned of_grid = build_of_grid(rounded, range.y); !(kernel.builds & of_grid)) {
            if (!kernel.builds)
                check(kernel, {argument_type(arguments)...});
            compile_kernel(device, kernel, {std::is_same_v<Arguments, Image> ? 0 : sizeof arguments...},
                           {rounded, range.y}, group);
            kernel.builds |= of_grid;
        }
        cl_uint index = 0;
        (kernel.kernel.setArg(index++, argument_value(arguments)), ...);
        keep_order(device);
        queue_of(device).enqueueNDRangeKernel(kernel.kernel, cl::NullRange, cl::NDRange(rounded, range.y),
                                              cl::NDRange(group, 1));
    };
    ask(device, start, "refused ", kernel.description);
}

/// The time in which an operation starts its kernels. If an exception ends it, the queue is finished first, so that no kernel
/// uses memory that is about to go. Declare it after whatever kernels read from the host, and before the first kernel.
class Launched {
public:
    /// What follows waits for `launch.wait`.
    /// Throws: std::invalid_argument for a queue that is not the device's own.
    explicit Launched(const Device& device, const Launch& launch = {});
    ~Launched();
    Launched(const Launched&) = delete;
    Launched& operator=(const Launched&) = delete;

    /// Everything is started: makes `launch.event`, if it is wanted.
    void done() const;

private:
    Device device_;
    cl_event* event_;
    int exceptions_; // in flight when this began
};

} // namespace fathom::runtime
