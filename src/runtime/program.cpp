// Programs: the embedded kernel files put together and built for a device, once per set of finite choices.
// PoCL keeps its own cache of what it compiled, so none is written here.

#include "runtime/program.hpp"

#include "runtime/state.hpp"
#include "text.hpp"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <system_error>

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

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
    const auto found = fathom_kernel_files().find(file);
    if (found == fathom_kernel_files().end())
        throw Error(text("no kernel file named ", file, " is built in"));

    const std::string path = text("\"kernels/", file, "\"\n");
    source += "#line 1 " + path;
    std::istringstream lines(found->second);
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

} // namespace

std::string assembled_source(const std::string& file) {
    std::string source;
    std::set<std::string> included;
    append(source, file, included);
    return source;
}

namespace {

// A driver's own message, or what it says instead.
std::string build_log(const cl::Program& program, const cl::Device& device) {
    try {
        return program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device);
    } catch (const cl::Error&) {
        return "(the driver gives no log)";
    }
}

// The folder where PoCL keeps what it compiles. Source: PoCL 3.1 and 6.0, "Environment variables".
std::filesystem::path pocl_folder() {
    const auto variable = [](const char* name) {
        const char* const value = std::getenv(name);
        return std::filesystem::path(value ? value : "");
    };
    if (const auto own = variable("POCL_CACHE_DIR"); !own.empty())
        return own;
    if (const auto cache = variable("XDG_CACHE_HOME"); !cache.empty())
        return cache / "pocl/kcache";
    const auto home = variable("HOME");
    return home.empty() ? "/tmp/pocl/kcache" : home / ".cache/pocl/kcache";
}

// Why as much as a kernel takes cannot be written into a folder; 0 where it can be.
int refusal_to_write(const std::filesystem::path& folder) {
    std::error_code failure;
    std::filesystem::create_directories(folder, failure);
    if (failure)
        return failure.value();
    std::string name = (folder / ("fathom-" + std::string(6, 'X'))).string(); // mkstemp asks for these six
    const int file = mkstemp(name.data());
    if (file < 0)
        return errno;
    constexpr off_t most = 1 << 20;
    rlimit limit{};
    const bool limited =
        getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur < rlim_t{most}; // to try would be a signal
    const int refusal = limited ? EFBIG : posix_fallocate(file, 0, most);
    close(file);
    unlink(name.c_str());
    return refusal;
}

// The folder, and why PoCL cannot write into it.
std::string described(int refusal) {
    return text(pocl_folder().string(), ", where ", refusal == EFBIG ? "files must be small" : "nothing can be written",
                " (", std::generic_category().message(refusal), "); ",
                refusal == EFBIG ? "raise the limit of file sizes (ulimit -f)"
                                 : "make room there, or let POCL_CACHE_DIR name another folder");
}

// Where PoCL cannot write what it compiles, it says no more than that it does not compile. On a full disk its compiler may end
// the process, so that is looked for before. Others are told when the build has failed.
void check_pocl_folder(const std::string& file, const Device& device, bool has_failed) {
    if (device.info().platform != "Portable Computing Language")
        return;
    if (const int refusal = refusal_to_write(pocl_folder());
        refusal == ENOSPC || refusal == EDQUOT || (has_failed && refusal != 0))
        throw Error(text("kernels/", file, " is not compiled: PoCL keeps what it compiles in ", described(refusal)));
}

// Under the context's lock, so that two threads do not build the same.
cl::Program program(const Device& device, const std::string& file, const std::string& options) {
    Context& context = *device.state().shared;
    const auto lock = locked(context.programs_mutex);
    const std::string key = file + ' ' + options;
    if (const auto found = context.programs.find(key); found != context.programs.end())
        return found->second;
    check_pocl_folder(file, device, false);
    const cl::Program built(context.context, assembled_source(file));
    try {
        built.build({context.device}, options.c_str());
    } catch (const cl::Error& error) {
        if (error.err() != CL_BUILD_PROGRAM_FAILURE) // the compiler did not come so far as to have a log
            throw;
        check_pocl_folder(file, device, true);
        throw Error(text("kernels/", file, " does not build on ", device.info().name, " with ", options,
                         "; try another device or driver, or report this:\n", build_log(built, context.device)));
    }
    return context.programs.emplace(key, built).first->second;
}

} // namespace

std::string pocl_refusal() {
    const int refusal = refusal_to_write(pocl_folder());
    return refusal == 0 || refusal == EFBIG ? "" : described(refusal);
}

Kernel& kernel(const Device& device, const std::string& name, Defines defines) {
    Device::State& state = device.state();
    defines.emplace_back("FP64", state.options.arithmetic == Arithmetic::fp64);
    defines.emplace_back("CLANG_BUILTINS", state.clang_builtins);
    const std::string options = build_options(defines, state.info.correct_rounding);
    const std::string key = name + ' ' + options;
    {
        const auto lock = locked(state.mutex);
        if (const auto found = state.kernels.find(key); found != state.kernels.end())
            return found->second;
    }
    const std::string file = file_of(name);
    const auto make = [&]() -> Kernel& {
        const cl::Kernel made(program(device, file, options), name.c_str());
        const auto lock = locked(state.mutex);
        return state.kernels.emplace(key, Kernel{made, text("kernels/", file, ' ', options)}).first->second;
    };
    return ask(device, make, "refused kernels/", file);
}

} // namespace fathom::runtime
