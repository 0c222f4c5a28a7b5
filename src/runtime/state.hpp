#pragma once

#include "runtime/program.hpp"

#include <fathom/device.hpp>

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

} // namespace fathom
