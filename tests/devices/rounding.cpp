// Stands between a program and OpenCL's loader (LD_PRELOAD): in each kernel's source the line that keeps products and sums
// apart becomes the text ROUNDING of the environment. So a device of PoCL rounds otherwise than IEEE 754 says.

#include <CL/cl.h>

#include <dlfcn.h>

#include <cstdlib>
#include <string>

extern "C" cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char** sources,
                                                const size_t* lengths, cl_int* error) {
    static const auto next =
        reinterpret_cast<decltype(&clCreateProgramWithSource)>(dlsym(RTLD_NEXT, "clCreateProgramWithSource"));
    const std::string line = "#pragma OPENCL FP_CONTRACT OFF\n";
    std::string all;
    for (cl_uint i = 0; i < count; ++i)
        all += lengths && lengths[i] != 0 ? std::string(sources[i], lengths[i]) : std::string(sources[i]);
    const std::size_t at = all.find(line);
    const char* const rounding = std::getenv("ROUNDING");
    if (rounding && at != std::string::npos)
        all.replace(at, line.size(), std::string(rounding) + '\n');
    const char* whole = all.c_str();
    return next(context, 1, &whole, nullptr, error);
}
