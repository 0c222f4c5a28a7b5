#pragma once

#include "params.h"
#include "runtime/opencl.hpp"
#include "runtime/state.hpp"

#include <fathom/fathom.hpp>

#include <string>

namespace fathom::bench {

/// The kernels of baselines.cl.
class Baselines {
public:
    explicit Baselines(const Device& device);

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

    /// Starts a kernel that makes three floats a pixel of one, with `arguments` before the sizes. Returns `to`.
    template <typename... Arguments>
    Image vectors_from(const Image& from, const Image& to, const std::string& name, const Arguments&... arguments) {
        start(name, from.width(), from.height(), runtime::buffer_of(from), runtime::buffer_of(to), arguments...,
              cl_int{from.width()}, cl_int{from.height()}, static_cast<cl_int>(from.row_stride()),
              static_cast<cl_int>(to.row_stride()));
        return to;
    }

    /// Work-items that a row of pixels takes, and the kernels' view of two images.
    int vectors(int width) const;
    static params::grid_params grid(const Image& source, const Image& target);

private:
    void start(const cl::Kernel& kernel, int columns, int rows);

    Device device_;
    cl::Program program_;
};

/// fx, fy, cx, cy of a perspective whose view axes are OpenGL's, fy negative: rows go down and y goes up.
cl_float4 pinhole_of(const Camera& camera);

} // namespace fathom::bench
