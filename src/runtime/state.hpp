#pragma once

#include "runtime/program.hpp"

#include <fathom/image.hpp>

#include <map>
#include <string>
#include <vector>

namespace fathom {

/// What the copies of a `Device` share.
struct Device::State {
    DeviceInfo info;
    DeviceOptions options; // with the automatic choices made
    cl::Device device;
    cl::Context context;
    cl::CommandQueue queue;
    std::map<std::string, runtime::Kernel> kernels;
    std::vector<cl::Buffer> scratch; // runtime/scratch.hpp
};

namespace runtime {

inline const cl::CommandQueue& queue_of(const Device& device) {
    return device.state().queue;
}
inline const cl::Context& context_of(const Device& device) {
    return device.state().context;
}
inline cl::Buffer buffer_of(const Image& image) {
    return cl::Buffer(image.buffer(), true);
}

} // namespace runtime
} // namespace fathom
