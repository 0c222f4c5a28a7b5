// Stands between a program and OpenCL's loader (LD_PRELOAD), and makes PoCL's device another one:
//   ROUNDING=TEXT   in each kernel's source, TEXT takes the place of the line that keeps products and sums apart
//   FLOAT_WIDTH=N   CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT is N. PoCL always names the vectors of this processor

#include <CL/cl.h>

#include <dlfcn.h>

#include <cstdlib>
#include <cstring>
#include <string>

namespace {

template <class Function>
Function* next(const char* name) {
    return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

} // namespace

extern "C" cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char** sources,
                                                const size_t* lengths, cl_int* error) {
    static const auto create = next<decltype(clCreateProgramWithSource)>("clCreateProgramWithSource");
    const std::string line = "#pragma OPENCL FP_CONTRACT OFF\n";
    std::string all;
    for (cl_uint i = 0; i < count; ++i)
        all += lengths && lengths[i] != 0 ? std::string(sources[i], lengths[i]) : std::string(sources[i]);
    const std::size_t at = all.find(line);
    const char* const rounding = std::getenv("ROUNDING");
    if (rounding && at != std::string::npos)
        all.replace(at, line.size(), std::string(rounding) + '\n');
    const char* whole = all.c_str();
    return create(context, 1, &whole, nullptr, error);
}

// Another rounding needs PoCL's own header, where sqrt is a macro.
extern "C" cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                                 void (*notify)(cl_program, void*), void* data) {
    static const auto build = next<decltype(clBuildProgram)>("clBuildProgram");
    const std::string own = " -D_OPENCL_H_ -DBUILTINS";
    std::string all = options ? options : "";
    if (const std::size_t at = all.find(own); at != std::string::npos && std::getenv("ROUNDING"))
        all.erase(at, own.size());
    return build(program, count, devices, all.c_str(), notify, data);
}

extern "C" cl_int clGetDeviceInfo(cl_device_id device, cl_device_info what, size_t size, void* value, size_t* needed) {
    static const auto get = next<decltype(clGetDeviceInfo)>("clGetDeviceInfo");
    const cl_int status = get(device, what, size, value, needed);
    const char* const width = std::getenv("FLOAT_WIDTH");
    if (width && status == CL_SUCCESS && value && what == CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT) {
        const cl_uint floats = static_cast<cl_uint>(std::atoi(width));
        std::memcpy(value, &floats, sizeof floats);
    }
    return status;
}
