#include "baselines.hpp"

#include "operations/parameters.hpp"

const std::map<std::string, std::string>& fathom_baseline_files(); // generated from baselines.cl

namespace fathom::bench {

Baselines::Baselines(const Device& device, bool stream) : device_(device) {
    std::string source = fathom_baseline_files().at("baselines.cl");
    const std::string include = "#include \"lanes.h\"\n";
    source.replace(source.find(include), include.size(), runtime::assembled_source("lanes.h"));
    program_ = cl::Program(device.context(), source);
    const int lanes = device.options().lanes;
    program_.build(text("-cl-std=CL1.2 -DFP64=0 -DV=", lanes, " -DSTREAM=", stream && lanes > 1).c_str());
}

void Baselines::launch(const std::string& name, const Image& source, const Image& target,
                       std::initializer_list<float> extra) {
    cl::Kernel kernel(program_, name.c_str());
    const auto lanes = static_cast<std::size_t>(device_.options().lanes);
    const auto group = static_cast<std::size_t>(device_.options().group_size);
    const std::size_t columns = (static_cast<std::size_t>(source.width()) + lanes - 1) / lanes;
    const StoredDepth whole{source, {}, Storage::float32};
    kernel.setArg(0, source.buffer());
    kernel.setArg(1, target.buffer());
    kernel.setArg(2, grid_parameters(whole, target, 0, source.width()));
    cl_uint index = 3;
    for (const float value : extra)
        kernel.setArg(index++, value);
    device_.queue().enqueueNDRangeKernel(
        kernel, cl::NullRange,
        cl::NDRange((columns + group - 1) / group * group, static_cast<std::size_t>(source.height())),
        cl::NDRange(group, 1));
}

} // namespace fathom::bench
