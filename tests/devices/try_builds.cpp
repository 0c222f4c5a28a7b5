// Builds kernels with a driver's compiler, which may crash: then one line says on which build, and the next process goes on. PoCL
// compiles a kernel when it is started, so a group of 64 work-items runs. All numbers are zeros, with which a kernel has no pixels
// and has to do nothing: what compiles apart from a program (src/runtime/compiler.hpp) counts on that.
// usage: try_builds PROCESSES <LINES, each a file of kernels and its definitions: ssao/ssao.cl -DV=16 …

#include "runtime/program.hpp"

#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <map>
#include <string>
#include <vector>

namespace {

using namespace fathom::runtime;

constexpr itimerval most{
    {}, {120, 0}}; // seconds of the processor for one build. normals takes 34 with SSE2, most others one or two

cl::Device pocl_device() {
    std::vector<cl::Platform> platforms;
    cl::Platform::get(&platforms);
    for (const cl::Platform& platform : platforms)
        if (platform.getInfo<CL_PLATFORM_NAME>().starts_with("Portable Computing Language")) {
            std::vector<cl::Device> devices;
            platform.getDevices(CL_DEVICE_TYPE_CPU, &devices);
            if (!devices.empty())
                return devices.front();
        }
    throw std::runtime_error("PoCL has no CPU device here");
}

/// Compiles one line after the other in this process.
class Compiler {
public:
    Compiler() : device_(pocl_device()), context_(device_), queue_(context_, device_) {}

    // Throws where something is wrong, and the driver's own words are on stdout. The options are those of the library.
    void compile(const std::string& line) const {
        const std::size_t blank = line.find(' ');
        cl::Program program(context_, assembled_source(line.substr(0, blank)));
        const std::string options = "-w -cl-std=CL1.2 -cl-kernel-arg-info -cl-fp32-correctly-rounded-divide-sqrt" +
                                    line.substr(blank) + " -D_OPENCL_H_ -DBUILTINS";
        try {
            program.build({device_}, options.c_str());
        } catch (const cl::Error&) {
            std::cout << program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device_) << std::endl;
            throw;
        }
        std::vector<char> zeros(3 * page); // of which kernels are given the middle
        const cl::Buffer buffer(context_, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, page, zeros.data() + page);
        std::vector<cl::Kernel> kernels;
        program.createKernels(&kernels);
        for (cl::Kernel& kernel : kernels) {
            for (cl_uint i = 0; i < kernel.getInfo<CL_KERNEL_NUM_ARGS>(); ++i)
                if (kernel.getArgInfo<CL_KERNEL_ARG_ADDRESS_QUALIFIER>(i) == CL_KERNEL_ARG_ADDRESS_GLOBAL)
                    kernel.setArg(i, buffer);
                else
                    kernel.setArg(i, std::array<char, page>()); // of any size
            queue_.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(64, 1), cl::NDRange(64, 1));
        }
        queue_.finish();
        if (std::ranges::any_of(zeros, [](char byte) { return byte != 0; }))
            throw std::runtime_error("it writes where all its numbers are zeros");
    }

private:
    static constexpr std::size_t page = 4096;

    cl::Device device_;
    cl::Context context_;
    cl::CommandQueue queue_;
};

/// What the processes share: the line that comes next, and the one that each is at.
struct Shared {
    std::atomic<std::size_t> next = 0;
    std::array<std::atomic<std::size_t>, 64> at = {};
};

// The exit code says how a process ended that nothing killed.
enum End { all_done = 0, line_failed = 1, no_device = 2 };

End compile_lines(const std::vector<std::string>& lines, Shared& shared, std::size_t place) {
    try {
        const Compiler compiler;
        for (std::size_t number; (number = shared.next++) < lines.size();) {
            shared.at[place] = number;
            setitimer(ITIMER_PROF, &most, nullptr);
            try {
                compiler.compile(lines[number]);
            } catch (const std::exception& error) {
                std::cout << error.what() << std::endl;
                return line_failed;
            }
        }
        return all_done;
    } catch (const std::exception& error) {
        std::cout << error.what() << std::endl;
        return no_device;
    }
}

// The end of what a process printed, on one line.
std::string said(std::FILE* stream) {
    constexpr std::size_t most = 600;
    std::string text;
    std::rewind(stream);
    for (int c; (c = std::fgetc(stream)) != EOF;)
        text += c == '\n' ? ' ' : static_cast<char>(c);
    std::fclose(stream);
    return text.size() > most ? "…" + text.substr(text.size() - most) : text;
}

} // namespace

int main(int argc, char** argv) {
    std::vector<std::string> lines;
    for (std::string line; std::getline(std::cin, line);)
        lines.push_back(line);
    Shared& shared =
        *new (mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Shared;
    {
        std::vector<cl::Platform>
            loaded; // once for all processes. PoCL starts no thread before it is asked for its devices.
        cl::Platform::get(&loaded);
    }

    struct Process {
        std::size_t place;
        std::FILE* output;
    };
    std::map<pid_t, Process> running;
    const auto start = [&](std::size_t place) {
        std::FILE* const output = std::tmpfile();
        const pid_t process = fork();
        if (process == 0) {
            dup2(fileno(output), STDOUT_FILENO);
            dup2(fileno(output), STDERR_FILENO);
            std::_Exit(compile_lines(lines, shared, place));
        }
        running.emplace(process, Process{place, output});
    };
    const std::size_t processes = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 1;
    for (std::size_t place = 0; place < std::min(processes, shared.at.size()); ++place)
        start(place);
    int failed = 0;
    while (!running.empty()) {
        int status = 0;
        const auto ended = running.find(wait(&status));
        const auto [place, output] = ended->second;
        running.erase(ended);
        const std::string words = said(output);
        if (status == all_done)
            continue;
        if (WIFEXITED(status) && WEXITSTATUS(status) == no_device) {
            std::cout << words << std::endl;
            return no_device;
        }
        ++failed;
        std::cout << "FAILED " << lines.at(shared.at[place]) << ": "
                  << (WIFSIGNALED(status) ? strsignal(WTERMSIG(status)) : "does not build") << "; " << words
                  << std::endl;
        start(place);
    }
    std::cout << lines.size() << " builds, " << failed << " failed" << std::endl;
    return failed > 0;
}
