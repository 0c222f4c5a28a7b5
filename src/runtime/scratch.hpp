#pragma once

#include "runtime/opencl.hpp"

#include <fathom/image.hpp>

#include <vector>

namespace fathom::runtime {

/// Images that an operation needs between its passes. Their memory goes back to the device's pool when this goes out of
/// scope, so that a second call allocates nothing; the queue is in order, so nobody overwrites what is still read.
class Scratch {
public:
    explicit Scratch(const Device& device) : device_(device) {}
    ~Scratch();
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;

    /// An image whose rows start at multiples of 64 bytes. Its content is undefined.
    Image image(Element element, Layout layout);

private:
    Device device_;
    std::vector<cl::Buffer> used_;
};

/// Copies an image to another one of its size and type.
void copy(const Image& from, const Image& to);

} // namespace fathom::runtime
