#include "baselines.hpp"

#include "operations/parameters.hpp"

const std::map<std::string, std::string>& fathom_baseline_files(); // generated from baselines.cl

namespace fathom::bench {

Baselines::Baselines(const Device& device) : device_(device) {
    std::string source = fathom_baseline_files().at("baselines.cl");
    const std::string include = "#include \"vector.h\"\n";
    source.replace(source.find(include), include.size(), runtime::assembled_source("vector.h"));
    program_ = cl::Program(runtime::context_of(device), source);
    const int vector_width = device.options().vector_width;
    program_.build(text("-cl-std=CL1.2 -DFP64=0 -DCLANG_BUILTINS=1 -DV=", vector_width, " -DSTREAM=0").c_str());
}

int Baselines::vectors(int width) const {
    return (width + device_.options().vector_width - 1) / device_.options().vector_width;
}

params::grid_params Baselines::grid(const Image& source, const Image& target) {
    return grid_parameters({source, {}, Storage::float32}, target, 0, source.width());
}

void Baselines::launch(const std::string& name, const Image& source, const Image& target,
                       std::initializer_list<float> extra) {
    cl::Kernel kernel(program_, name.c_str());
    kernel.setArg(0, runtime::buffer_of(source));
    kernel.setArg(1, runtime::buffer_of(target));
    kernel.setArg(2, grid(source, target));
    cl_uint index = 3;
    for (const float value : extra)
        kernel.setArg(index++, value);
    start(kernel, vectors(source.width()), source.height());
}

void Baselines::start(const cl::Kernel& kernel, int columns, int rows) {
    const auto group = static_cast<std::size_t>(device_.options().group_size);
    runtime::queue_of(device_).enqueueNDRangeKernel(
        kernel, cl::NullRange,
        cl::NDRange((static_cast<std::size_t>(columns) + group - 1) / group * group, static_cast<std::size_t>(rows)),
        cl::NDRange(group, 1));
}

cl_float4 pinhole_of(const Camera& camera) {
    const Rays::Matrix rays = camera_rays(camera).direction;
    return {static_cast<float>(1 / rays(0, 0)), static_cast<float>(1 / rays(1, 1)),
            static_cast<float>(-rays(0, 2) / rays(0, 0)), static_cast<float>(-rays(1, 2) / rays(1, 1))};
}

} // namespace fathom::bench
