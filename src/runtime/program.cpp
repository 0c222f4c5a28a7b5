// Programs: the embedded kernel files put together and built for a device, once per set of finite choices.
// PoCL keeps its own cache of what it compiled, so none is written here.

#include "runtime/program.hpp"

#include "runtime/compiler.hpp"
#include "runtime/pocl.hpp"
#include "runtime/state.hpp"
#include "text.hpp"

#include <filesystem>
#include <set>

namespace fathom::runtime {
namespace {

// A kernel's file in kernels/: no two kernels have the same name.
std::string file_of(const std::string& kernel) {
    for (const auto& [path, content] : fathom_kernel_files())
        if (std::filesystem::path(path).filename() == kernel + ".cl")
            return path;
    throw Error(text("no kernel named ", kernel, " is built in"));
}

void append(std::string& source, const std::string& file, std::set<std::string>& included) {
    if (!included.insert(file).second)
        return;
    const std::string path = text("\"kernels/", file, "\"\n");
    source += "#line 1 " + path;
    std::istringstream lines(fathom_kernel_files().at(file)); // the build of the library has found every include
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        constexpr std::string_view include = "#include \"";
        if (line.starts_with(include)) {
            append(source, line.substr(include.size(), line.rfind('"') - include.size()), included);
            source += text("#line ", number + 1, " ", path);
        } else {
            source += line + '\n';
        }
    }
    if (lines.bad()) // which getline says of a string that has no memory
        throw std::bad_alloc();
}

std::string build_options(const Defines& defines, bool correct_rounding) {
    // No warnings: PoCL prints their number on stderr. The build of the library has checked the kernels.
    std::string options = "-w -cl-std=CL1.2 -cl-kernel-arg-info";
    if (correct_rounding)
        options += " -cl-fp32-correctly-rounded-divide-sqrt";
    for (const auto& [name, value] : defines) // at every launch, so without a stream
        options.append(" -D").append(name).append("=").append(std::to_string(value));
    return options;
}

// False where the driver's compiler refuses a program.
bool builds(const cl::Program& program, const cl::Device& device, const std::string& options) {
    try {
        program.build({device}, options.c_str());
        return true;
    } catch (const cl::Error& error) {
        if (error.err() != CL_BUILD_PROGRAM_FAILURE) // the compiler did not come so far as to have a log
            throw;
        return false;
    }
}

} // namespace

std::string assembled_source(const std::string& file) {
    std::string source;
    std::set<std::string> included;
    append(source, file, included);
    return source;
}

Build build(const cl::Context& context, const cl::Device& device, const std::string& file, const std::string& options,
            bool pocl) {
    // With these Clang's header opencl-c.h is empty, and kernels/builtins.h has what kernels call of it. PoCL reads that header
    // for every program; a version of it that takes this for an error gets the program without them.
    constexpr const char* own_builtins = " -D_OPENCL_H_ -DBUILTINS";
    const cl::Program program(context, assembled_source(file));
    return {program, (pocl && builds(program, device, options + own_builtins)) || builds(program, device, options)};
}

namespace {

// Under the context's lock, so that two threads do not build the same.
const cl::Program& program(const Device& device, const std::string& file, const std::string& options) {
    Context& context = *device.state().shared;
    const bool pocl = device.info().platform == "Portable Computing Language";
    const auto lock = locked(context.programs_mutex);
    const std::string key = file + ' ' + options;
    if (const auto found = context.programs.find(key); found != context.programs.end())
        return found->second;
    if (pocl) {
        check_linker();
        check_pocl_folder(file, false);
        compile_program(device, file, options);
    }
    const auto [built, succeeded] = build(context.context, context.device, file, options, pocl);
    if (!succeeded) {
        if (pocl)
            check_pocl_folder(file, true);
        const auto log = built.getBuildInfo<CL_PROGRAM_BUILD_LOG>(context.device);
        if (log.find("unknown target CPU 'generic'") != std::string::npos)
            throw NoDevice(text(device.info().name, " compiles nothing, since its driver (", device.info().version,
                                ") is too old to know this processor; install PoCL 3.1 or later, or let "
                                "OCL_ICD_VENDORS name another driver, such as libintelocl.so of the Python package "
                                "fathom-depth[cpu]"));
        throw Error(text("kernels/", file, " does not build on ", device.info().name, " with ", options,
                         "; try another device or driver, or report this:\n", log));
    }
    return context.programs.emplace(key, built).first->second;
}

} // namespace

Kernel& kernel(const Device& device, const std::string& name, Defines defines, const std::string& program_name) {
    Device::State& state = device.state();
    defines.emplace_back("FP64", state.options.arithmetic == Arithmetic::fp64);
    defines.emplace_back("CLANG_BUILTINS", state.clang_builtins);
    const std::string options = build_options(defines, state.info.correct_rounding);
    const std::string key = name + ' ' + program_name + ' ' + options;
    {
        const auto lock = locked(state.mutex);
        if (const auto found = state.kernels.find(key); found != state.kernels.end())
            return found->second;
    }
    const std::string file = file_of(program_name.empty() ? name : program_name);
    const auto make = [&]() -> Kernel& {
        const cl::Kernel made(program(device, file, options), name.c_str());
        const auto lock = locked(state.mutex);
        return state.kernels.emplace(key, Kernel{made, name, file, options, text("kernels/", file, ' ', options)})
            .first->second;
    };
    return ask(device, make, "refused kernels/", file);
}

} // namespace fathom::runtime
