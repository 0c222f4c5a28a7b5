// The linker puts these functions between the library and the loader (--wrap): how long each kernel takes to compile.

#include "compile_times.hpp"

#include <CL/cl.h>

#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <set>
#include <string>

namespace {

struct Seen {
    std::map<cl_program, double> builds;
    std::set<cl_kernel> started;
    std::string operation;
    std::map<std::pair<std::string, std::string>, double> worst;
};

Seen& seen() {
    static Seen all;
    return all;
}

} // namespace

extern "C" {

cl_int __real_clBuildProgram(cl_program, cl_uint, const cl_device_id*, const char*, void (*)(cl_program, void*), void*);
cl_int __wrap_clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                             void (*notify)(cl_program, void*), void* data) {
    const double start = seconds_now();
    const cl_int status = __real_clBuildProgram(program, count, devices, options, notify, data);
    seen().builds[program] = seconds_now() - start;
    return status;
}

cl_int __real_clEnqueueNDRangeKernel(cl_command_queue, cl_kernel, cl_uint, const size_t*, const size_t*, const size_t*,
                                     cl_uint, const cl_event*, cl_event*);
cl_int __wrap_clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t* offset,
                                     const size_t* global, const size_t* local, cl_uint waits, const cl_event* wait,
                                     cl_event* event) {
    if (!seen().started.insert(kernel).second)
        return __real_clEnqueueNDRangeKernel(queue, kernel, dimensions, offset, global, local, waits, wait, event);
    clFinish(queue);
    const double start = seconds_now(); // drivers compile for a size of groups when the kernel first runs
    const cl_int status =
        __real_clEnqueueNDRangeKernel(queue, kernel, dimensions, offset, global, local, waits, wait, event);
    clFinish(queue);
    cl_program program = nullptr;
    char name[256] = {};
    clGetKernelInfo(kernel, CL_KERNEL_PROGRAM, sizeof(program), &program, nullptr);
    clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof(name) - 1, name, nullptr);
    double& worst = seen().worst[{seen().operation, name}];
    worst = std::max(worst, seen().builds[program] + seconds_now() - start);
    return status;
}
}

double seconds_now() {
    static const char* const wanted = std::getenv("CLOCK");
    static const bool processor = wanted && std::string(wanted) == "processor";
    timespec time{};
    clock_gettime(processor ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &time);
    rusage children{}; // PoCL starts a linker
    if (processor)
        getrusage(RUSAGE_CHILDREN, &children);
    const auto micro = children.ru_utime.tv_usec + children.ru_stime.tv_usec;
    return static_cast<double>(time.tv_sec + children.ru_utime.tv_sec + children.ru_stime.tv_sec) +
           1e-9 * static_cast<double>(time.tv_nsec) + 1e-6 * static_cast<double>(micro);
}

void compile_for(const std::string& operation) {
    seen().operation = operation;
}

const std::map<std::pair<std::string, std::string>, double>& compile_seconds() {
    return seen().worst;
}
