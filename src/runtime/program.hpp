#pragma once

#include "runtime/opencl.hpp"

#include <fathom/device.hpp>

#include <map>
#include <string>
#include <utility>
#include <vector>

/// Text of every file of kernels/, by its path there. Generated while building (cmake/embed.cmake).
const std::map<std::string, std::string>& fathom_kernel_files();

namespace fathom::runtime {

/// A file of kernels/ with the headers it includes in place, each once, and #line directives, so that a build log names the
/// file and the line that a person would open.
std::string assembled_source(const std::string& file);

/// A program of a file, and whether the driver's compiler took it.
struct Build {
    cl::Program program;
    bool succeeded;
};
Build build(const cl::Context& context, const cl::Device& device, const std::string& file, const std::string& options,
            bool pocl);

/// Finite choices that a kernel is built for: -D name=value.
using Defines = std::vector<std::pair<const char*, int>>;

/// A kernel of one file, built for one set of choices. It belongs to a queue: the lock of `Device::State` guards its arguments
/// and what was found out about it.
struct Kernel {
    cl::Kernel kernel;
    std::string name, file, options;
    std::string description;     ///< for messages: the file and its choices
    unsigned builds = 0;         ///< that were compiled (runtime/compiler.hpp), after its arguments were checked
    std::size_t group_limit = 0; ///< work-items per group that the device allows it; 0: not asked yet
};

/// The kernel `name` of the file <name>.cl, or of <program>.cl, which includes it and others that are needed with it. The program
/// is built when the context first asks for it.
/// Throws: Error with the build log.
Kernel& kernel(const Device& device, const std::string& name, Defines defines, const std::string& program = "");

} // namespace fathom::runtime
