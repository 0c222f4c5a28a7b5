#pragma once

#include "runtime/state.hpp"

#include <fathom/error.hpp>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

/// A process that compiles what PoCL's cache does not hold. PoCL compiles with LLVM, which aborts over what it cannot compile. Then
/// it is that process which crashes, and the program goes on with another vector width.
namespace fathom::runtime {

/// Starts that process, which is gone when this one ends, and asks it from now on. Call it from the main thread, before OpenCL is
/// used and threads work: it is a fork. Without it, and where PoCL keeps no cache, kernels are compiled in this process.
/// `version`: of all kernels. Another one's are asked for once more, and found in the cache if they did not change.
void compile_apart(const std::string& version);

/// Ends that process, and whoever compiles waits until this one ends, too. Any thread may call it.
void stop_compiling();

/// PoCL's compiler crashed on a kernel. The message names the kernel, the driver and what the compiler said last.
class CompilerCrashed : public NoDevice {
public:
    CompilerCrashed(const std::string& message, int width) : NoDevice(message), vector_width(width) {}

    int vector_width; ///< of the device, for which the kernel was to be compiled
};

/// Has a program compiled, unless it was before: the cache holds it then.
/// Throws: CompilerCrashed.
void compile_program(const Device& device, const std::string& file, const std::string& options);

/// The build of a kernel that a grid takes, as a bit: PoCL compiles for grids of 65535 and more once more. Where another version
/// draws the line below, those from 32768 on have one of their own.
unsigned build_of_grid(std::size_t columns, std::size_t rows);

/// Has a kernel compiled for a launch, as `compile_program`. `sizes`: of its params, in bytes; 0 for an image.
void compile_kernel(const Device& device, const Kernel& kernel, const std::vector<std::size_t>& sizes,
                    const std::array<std::size_t, 2>& global, std::size_t group);

/// Gives a device a vector width for which no compiler has crashed yet, and says so in words; the results have the same bits. Nobody
/// else may use the device meanwhile. Nothing is done where another thread has been here since.
/// Throws: CompilerCrashed where no width is left.
std::string take_another_width(const Device& device, const CompilerCrashed& crashed);

} // namespace fathom::runtime
