#pragma once

#include <fathom/fathom.hpp>

#include <string>

namespace fathom::bench {

/// The kernels of baselines.cl.
class Baselines {
public:
    Baselines(const Device& device, bool stream);

    /// Starts a kernel on every pixel, with up to two floats after the images.
    void launch(const std::string& name, const Image& source, const Image& target,
                std::initializer_list<float> extra = {});

private:
    Device device_;
    cl::Program program_;
};

} // namespace fathom::bench
