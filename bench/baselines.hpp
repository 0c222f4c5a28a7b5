#pragma once

#include "params.h"
#include "runtime/opencl.hpp"

#include <fathom/fathom.hpp>

#include <string>

namespace fathom::bench {

/// The kernels of baselines.cl.
class Baselines {
public:
    Baselines(const Device& device, bool stream);

    /// Starts a kernel on every pixel, with floats after the images.
    void launch(const std::string& name, const Image& source, const Image& target,
                std::initializer_list<float> extra = {});

    /// Starts a kernel of other arguments on so many work-items.
    template <typename... Arguments>
    void start(const std::string& name, int columns, int rows, const Arguments&... arguments) {
        cl::Kernel kernel(program_, name.c_str());
        cl_uint index = 0;
        (kernel.setArg(index++, arguments), ...);
        start(kernel, columns, rows);
    }

    /// Work-items that a row of pixels takes, and the kernels' view of two images.
    int vectors(int width) const;
    static params::grid_params grid(const Image& source, const Image& target);

private:
    void start(const cl::Kernel& kernel, int columns, int rows);

    Device device_;
    cl::Program program_;
};

} // namespace fathom::bench
